"""Rendered segments in a content store: a movie and its result, which appear complete or not at all."""

import json
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TypeVar

from lexicon.errors import BackendError, DataError
from lexicon.values.json_text import parse_json
from tts2face.serving.batch.segment import SEGMENT_SUFFIX
from tts2face.serving.batch.segment_result import SegmentResult, result_from_json
from tts2face.storage.bucket import StoreAwayError, Stored
from tts2face.storage.content_store import ContentStore, FolderStore, divided, open_content_store

MAX_RESULT_BYTES = 1_000_000
PAUSE_S = 5.0  # between two tries of a store that cannot be reached
RESULT_SUFFIX = ".json"


Value = TypeVar("Value")


def open_store(where: str | Path) -> "Store":
    """Store of a local folder, which is created, or of a URL of S3, Google Cloud Storage or Azure.

    Raises
    ------
    InputError
        The URL has an unknown scheme.
    BackendError
        The package obstore is missing, or the folder cannot be created.
    """
    store = Store(open_content_store(where))
    if store.folder is not None:
        try:
            store.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise BackendError(
                f"cannot create the folder {store.folder}: {error.strerror}; choose another one"
            ) from error
    return store


class Store:
    """Segments by content address; the result of one follows its movie."""

    def __init__(self, files: ContentStore) -> None:
        self.files = files
        self.folder = files.folder if isinstance(files, FolderStore) else None

    def check(self) -> None:
        """Refuse a store that cannot be written, before anything is rendered."""
        self.files.check()

    def scratch(self) -> Path | None:
        """Folder of the store for files that are being rendered; None if it is not local."""
        return self.files.scratch()

    def result(self, address: str) -> SegmentResult | None:
        """Result of a stored segment; None if it is not stored or damaged, so that it is rendered again."""
        # a result without its movie, as of a folder that was cleaned by hand
        if self.folder is not None and not self.files.get(_movie(address), 1):
            return None
        content = self.files.get(_result(address), MAX_RESULT_BYTES)
        if content is None:
            return None
        try:
            return result_from_json(parse_json(content.decode(), "the result of a segment"))
        except (ValueError, TypeError, AttributeError, DataError):
            return None

    def put(self, address: str, movie: Path, result: SegmentResult) -> None:
        """Move a movie into the store, then write its result; the same segment may be stored twice."""
        try:
            self.files.add(_movie(address), movie)
        except OSError as error:
            target = f"{self.files.place}/{_movie(address)}"
            raise BackendError(f"cannot write {target}: {error.strerror}; free some space") from error
        self.files.put(_result(address), json.dumps(result.as_json()).encode())
        movie.unlink(missing_ok=True)

    def fetch(self, address: str, folder: Path) -> Path:
        """Local path of a stored segment, copied into a folder if it is not local.

        Raises
        ------
        BackendError
            It is not stored.
        """
        try:
            return self.files.lend(_movie(address), folder / f"{address}{SEGMENT_SUFFIX}")
        except FileNotFoundError:
            # so that the next run renders it
            self.remove(address)  # a result without its movie
            raise BackendError(f"the segment {address[:12]} is missing in {self.files.place}; run again") from None

    def addresses(self) -> Iterator[str]:
        """Addresses of all stored segments."""
        for entry in self.files.entries():
            address = Path(entry.name).stem
            if entry.name == _result(address):
                yield address

    def entries(self) -> Iterator[Stored]:
        """All stored segments by address; each with the bytes of its files together, and the time of the latest."""
        found: dict[str, Stored] = {}
        for entry in self.files.entries():
            address = Path(entry.name).stem
            if entry.name in (_movie(address), _result(address)):
                other = found.get(address, Stored(address, 0, 0.0))
                found[address] = Stored(address, other.n_bytes + entry.n_bytes, max(other.stored_s, entry.stored_s))
        yield from found.values()

    def remove(self, address: str) -> None:
        """Remove a segment, its result first, if it is stored."""
        self.files.delete(_result(address))
        self.files.delete(_movie(address))


def _movie(address: str) -> str:
    return divided(f"{address}{SEGMENT_SUFFIX}")


def _result(address: str) -> str:
    return divided(f"{address}{RESULT_SUFFIX}")


def wait_for_store(action: Callable[[], Value], on_message: Callable[[str], None]) -> Value:
    """Value of an action on a store; while the store cannot be reached, wait, say so, and try again."""
    is_waiting = False
    while True:
        try:
            value = action()
        except StoreAwayError as away:
            if not is_waiting:
                on_message(f"paused: {away}")
                is_waiting = True
            time.sleep(PAUSE_S)
            continue
        if is_waiting:
            on_message("continued: the store can be reached again")
        return value
