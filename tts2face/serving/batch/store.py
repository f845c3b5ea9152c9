"""Stores of rendered segments: a local folder, or a bucket by URL. A segment appears complete or not at all."""

import json
import shutil
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Protocol, TypeVar

from lexicon.errors import BackendError, InputError
from tts2face.serving.batch.object_store import RESULT_SUFFIX, StoreAwayError, StoredSegment, parse_result, sum_files
from tts2face.serving.batch.segment import SEGMENT_SUFFIX, SegmentResult
from tts2face.storage.files import write_atomically
from tts2face.storage.temporary import NAME_INFIX, Temporary

MAX_RESULT_BYTES = 1_000_000
PAUSE_S = 5.0  # between two tries of a store that cannot be reached
REMOTE_SCHEMES = ("s3://", "gs://", "az://", "abfs://", "file://", "memory://")


Value = TypeVar("Value")


class Store(Protocol):
    """Segments by content address, for any number of processes."""

    def check(self) -> None:
        """Refuse a store that cannot be written, before anything is rendered."""

    def result(self, address: str) -> SegmentResult | None:
        """Result of a stored segment; None if it is not stored."""

    def put(self, address: str, movie: Path, result: SegmentResult) -> None:
        """Store a segment; the same segment may be stored twice."""

    def fetch(self, address: str, folder: Path) -> Path:
        """Local path of a stored segment, copied into a folder if it is not local."""

    def addresses(self) -> Iterator[str]:
        """Addresses of all stored segments."""

    def entries(self) -> Iterator[StoredSegment]:
        """All stored segments with their sizes and times."""

    def remove(self, address: str) -> None:
        """Remove a segment, if it is stored."""

    def scratch(self) -> Path | None:
        """Folder of the store for files that are being rendered; None if it is not local."""


def open_store(where: str | Path) -> Store:
    """Store of a local folder, or of a URL of S3, Google Cloud Storage or Azure.

    Raises
    ------
    InputError
        The URL has an unknown scheme.
    BackendError
        The package obstore is missing, or the folder cannot be created.
    """
    text = str(where)
    if text.startswith(REMOTE_SCHEMES):
        from tts2face.serving.batch.object_store import ObjectStore

        return ObjectStore(text)
    if "://" in text:
        raise InputError(
            f"there is no store {text}; give a folder, or a URL that begins with {', '.join(REMOTE_SCHEMES)}"
        )
    return FolderStore(Path(text))


class FolderStore:
    """A local folder; files appear by rename, the result after its movie."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise BackendError(f"cannot create the folder {folder}: {error.strerror}; choose another one") from error

    def check(self) -> None:
        """Refuse a folder that cannot be written.

        Raises
        ------
        BackendError
            It cannot be written.
        """
        try:
            folder = self.scratch() or self.folder
            with Temporary(folder / "check"):
                pass
        except OSError as error:
            raise BackendError(
                f"cannot write the folder {self.folder}: {error.strerror}; change its permissions or choose another one"
            ) from error

    def result(self, address: str) -> SegmentResult | None:
        """Result of a stored segment; None if it is not stored or damaged."""
        movie = self._path(address)
        try:
            if movie.stat().st_size == 0:
                return None
            content = movie.with_suffix(RESULT_SUFFIX).read_bytes()[:MAX_RESULT_BYTES]
        except OSError:
            return None
        return parse_result(content)

    def put(self, address: str, movie: Path, result: SegmentResult) -> None:
        """Move a movie into the store, then write its result."""
        target = self._path(address)
        target.parent.mkdir(exist_ok=True)
        try:
            if movie.parent == target.parent or movie.stat().st_dev == target.parent.stat().st_dev:
                movie.replace(target)
            else:
                with Temporary(target) as temporary:
                    shutil.copyfile(movie, temporary.path)
                    temporary.replace(target)
        except OSError as error:
            raise BackendError(f"cannot write {target}: {error.strerror}; free some space") from error
        write_atomically(target.with_suffix(RESULT_SUFFIX), json.dumps(result.as_json()).encode())

    def fetch(self, address: str, folder: Path) -> Path:
        """Path of a stored segment."""
        del folder
        return self._path(address)

    def addresses(self) -> Iterator[str]:
        """Addresses of all stored segments."""
        for path in sorted(self.folder.glob(f"??/*{RESULT_SUFFIX}")):
            if NAME_INFIX not in path.name:
                yield path.stem

    def entries(self) -> Iterator[StoredSegment]:
        """All stored segments with their sizes and times."""
        for folder in sorted(self.folder.glob("??")):
            paths = [path for path in folder.iterdir() if path.suffix in (SEGMENT_SUFFIX, RESULT_SUFFIX)]
            yield from sum_files((path.stem, path.stat().st_size, path.stat().st_mtime) for path in paths)

    def remove(self, address: str) -> None:
        """Remove a segment, its result first."""
        movie = self._path(address)
        movie.with_suffix(RESULT_SUFFIX).unlink(missing_ok=True)
        movie.unlink(missing_ok=True)

    def scratch(self) -> Path | None:
        """Folder in which segments are rendered, so that they can be moved into place."""
        folder = self.folder / "scratch"
        folder.mkdir(exist_ok=True)
        return folder

    def _path(self, address: str) -> Path:
        return self.folder / address[:2] / f"{address}{SEGMENT_SUFFIX}"


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
