"""Finished speech and clips on disk, by the hash of everything that determines them.

A folder of files, each the messages of one result, of which the least recently used are removed when all together are
larger than the budget. An entry appears when its result is complete; several servers may share a folder.
"""

import asyncio
import hashlib
import json
from collections.abc import AsyncIterator, Mapping
from contextlib import aclosing, suppress
from pathlib import Path
from typing import Any, BinaryIO

from tts2face import __version__
from tts2face.processes.message import RESULT, Message, read_message
from tts2face.serving.service.messages import QUALITY, Work
from tts2face.storage.content_store import FolderStore, content_hash
from tts2face.storage.temporary import Temporary

FORMAT = 4  # of entries; those of others are not found
CACHED_KINDS = frozenset({"file", "speech"})
MAX_SHARE = 0.25  # of the budget that one entry may take
FILE_FIELDS = (
    "audio",
    "partner",
    "timeline",
    "dictionary",
    "text_marks",
    "background",
)  # whose files are read while a result is made


def work_hash(work: Work) -> str:
    """SHA-256 of a task with the contents of its files, of the version of the program, and of the format of entries."""
    described = work.as_json()
    del described["keeps_pace"]  # what is kept has the full quality
    described["request"] = _with_contents(work.request)
    described["picture"] = _with_contents(work.picture)
    described["models"] = {name: _file_state(value) for name, value in work.models.items()}
    text = json.dumps([__version__, FORMAT, described], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


def _with_contents(fields: Mapping[str, Any]) -> dict[str, Any]:
    return {name: _content_hash(value) if name in FILE_FIELDS else value for name, value in fields.items()}


def _content_hash(value: Any) -> Any:
    """Hash of the file of a path; another value, such as a colour, itself."""
    if not isinstance(value, str) or not Path(value).is_file():
        return value
    return ["file", content_hash(Path(value))]


def _file_state(value: Any) -> Any:
    """Path, size and time of a model's file; a name itself."""
    if not isinstance(value, str) or not Path(value).is_file():
        return value
    state = Path(value).stat()
    return [value, state.st_size, state.st_mtime_ns]


class ResultCache:
    """Results in a folder.

    Parameters
    ----------
    folder
        Created if it does not exist; it should contain nothing else.
    max_bytes
        Budget of all entries.
    """

    def __init__(self, folder: Path, max_bytes: int) -> None:
        self._store, self._max_bytes = FolderStore(folder), max_bytes
        self.n_hits = self.n_misses = 0
        # texts lie there in the form of their speech (decision 098)
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        self._store.remove_drafts()
        self.n_bytes = self._store.prune(max_bytes=max_bytes)  # size of all entries

    async def messages(self, work: Work, made: AsyncIterator[Message]) -> AsyncIterator[Message]:
        """Messages of the entry of a task; without one those of `made`, which become an entry in the end."""
        name = await asyncio.to_thread(work_hash, work)
        entry = self._open(name)
        if entry is not None:
            with entry:
                await made.aclose()  # type: ignore[attr-defined]
                while message := await asyncio.to_thread(read_message, entry):
                    yield message
            return
        draft = _Draft(self._store, int(MAX_SHARE * self._max_bytes))
        try:
            async with aclosing(made):  # type: ignore[type-var]
                async for message in made:
                    # the cache keeps nothing that was drawn with less quality (decision 182)
                    if message.content.get("event", {}).get("type") == QUALITY:
                        draft.close()
                    await asyncio.to_thread(draft.add, message)
                    if message.kind == RESULT:
                        await asyncio.to_thread(self._keep, name, draft)
                    yield message
        finally:
            draft.close()

    def _open(self, name: str) -> BinaryIO | None:
        try:
            entry = self._store.path(name).open("rb")
        except OSError:
            self.n_misses += 1
            return None
        with suppress(OSError):
            self._store.touch(name)
        self.n_hits += 1
        return entry

    def _keep(self, name: str, draft: "_Draft") -> None:
        """Make a draft an entry, for which others give way."""
        with suppress(OSError):
            self.n_bytes += draft.keep(name)
            if self.n_bytes > self._max_bytes:
                self.n_bytes = self._store.prune(max_bytes=self._max_bytes)


class _Draft:
    """An entry that is being written; given up when it becomes too large or the disk is full."""

    def __init__(self, store: FolderStore, max_bytes: int) -> None:
        self._store, self._max_bytes = store, max_bytes
        self._n_bytes = 0
        self._temporary: Temporary | None = None
        with suppress(OSError):
            self._temporary = store.draft()
            self._file = self._temporary.path.open("wb")

    def add(self, message: Message) -> None:
        if self._temporary is None:
            return
        content = message.encoded()
        self._n_bytes += len(content)
        try:
            if self._n_bytes > self._max_bytes:
                self.close()
            else:
                self._file.write(content)
        except OSError:
            self.close()

    def keep(self, name: str) -> int:
        """Make the draft, which is complete, an entry; its bytes, 0 where it was given up."""
        if self._temporary is None:
            return 0
        self._file.flush()
        self._store.keep(self._temporary, name)
        self._store.touch(name)
        return self._n_bytes

    def close(self) -> None:
        """Remove the file unless it has become an entry."""
        temporary, self._temporary = self._temporary, None
        if temporary is not None:
            with suppress(OSError):
                self._file.close()
            temporary.remove()
