"""Finished speech and clips on disk, by the hash of everything that determines them.

A folder of files, each the messages of one result, of which the least recently used are removed when all together are
larger than the budget. An entry appears when its result is complete; several servers may share a folder.
"""

import asyncio
import hashlib
import json
import os
import tempfile
from collections import OrderedDict
from collections.abc import AsyncIterator, Mapping
from contextlib import aclosing, suppress
from pathlib import Path
from typing import Any, BinaryIO

from tts2face import __version__
from tts2face.processes.message import RESULT, Message, read_message
from tts2face.serving.service.messages import Work

FORMAT = 2  # of entries; those of others are not found
CACHED_KINDS = frozenset({"file", "speech"})
MAX_SHARE = 0.25  # of the budget that one entry may take
FILE_FIELDS = ("audio", "timeline", "dictionary", "background")  # whose files are read while a result is made


def work_hash(work: Work) -> str:
    """SHA-256 of a work with the contents of its files, of the version of the program, and of the format of entries."""
    described = work.as_json()
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
    with Path(value).open("rb") as file:
        return ["file", hashlib.file_digest(file, "sha256").hexdigest()]


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
        self._folder, self._max_bytes = folder, max_bytes
        self._sizes: OrderedDict[str, int] = OrderedDict()  # the least recently used first
        self.n_hits = self.n_misses = 0
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        found = [(path.stat().st_mtime, path) for path in folder.iterdir()]
        for _, path in sorted(found):
            if path.suffix:  # of a result that was not completed
                path.unlink(missing_ok=True)
            else:
                self._sizes[path.name] = path.stat().st_size
        self._make_room(0)

    @property
    def n_bytes(self) -> int:
        """Size of all entries."""
        return sum(self._sizes.values())

    async def messages(self, work: Work, made: AsyncIterator[Message]) -> AsyncIterator[Message]:
        """Messages of the entry of a work; without one those of `made`, which become an entry in the end."""
        name = await asyncio.to_thread(work_hash, work)
        entry = self._open(name)
        if entry is not None:
            with entry:
                await made.aclose()  # type: ignore[attr-defined]
                while message := await asyncio.to_thread(read_message, entry):
                    yield message
            return
        draft = _Draft(self._folder, int(MAX_SHARE * self._max_bytes))
        try:
            async with aclosing(made):  # type: ignore[type-var]
                async for message in made:
                    await asyncio.to_thread(draft.add, message)
                    if message.kind == RESULT:
                        self._keep(name, draft)
                    yield message
        finally:
            draft.close()

    def _open(self, name: str) -> BinaryIO | None:
        try:
            entry = (self._folder / name).open("rb")
        except OSError:
            self._sizes.pop(name, None)
            self.n_misses += 1
            return None
        self._sizes[name] = os.fstat(entry.fileno()).st_size
        self._sizes.move_to_end(name)
        with suppress(OSError):
            os.utime(self._folder / name)
        self.n_hits += 1
        return entry

    def _keep(self, name: str, draft: "_Draft") -> None:
        if not draft.is_complete:
            return
        self._sizes.pop(name, None)
        self._make_room(draft.n_bytes)
        with suppress(OSError):
            draft.move_to(self._folder / name)
            self._sizes[name] = draft.n_bytes

    def _make_room(self, n_bytes: int) -> None:
        while self._sizes and self.n_bytes + n_bytes > self._max_bytes:
            name, _ = self._sizes.popitem(last=False)
            (self._folder / name).unlink(missing_ok=True)


class _Draft:
    """An entry that is being written; given up when it becomes too large or the disk is full."""

    def __init__(self, folder: Path, max_bytes: int) -> None:
        self._max_bytes, self.n_bytes, self.is_complete = max_bytes, 0, False
        self._file: Any = None
        with suppress(OSError):
            self._file = tempfile.NamedTemporaryFile(dir=folder, suffix=".part", delete=False)  # noqa: SIM115

    def add(self, message: Message) -> None:
        if self._file is None:
            return
        content = message.encoded()
        self.n_bytes += len(content)
        try:
            if self.n_bytes > self._max_bytes:
                self.close()
                return
            self._file.write(content)
            self.is_complete = message.kind == RESULT
            if self.is_complete:
                self._file.flush()
        except OSError:
            self.close()

    def move_to(self, path: Path) -> None:
        Path(self._file.name).replace(path)

    def close(self) -> None:
        """Remove the file unless it has been moved."""
        file, self._file = self._file, None
        if file is not None:
            file.close()
            Path(file.name).unlink(missing_ok=True)
