"""Stores of rendered segments: a local folder, or a bucket by URL. A segment appears complete or not at all."""

import contextlib
import json
import shutil
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from lexicon.errors import BackendError, DataError, InputError
from lexicon.inputs import parse_json
from tts2face.batch.segment_result import SEGMENT_SUFFIX, SegmentResult, result_from_json
from tts2face.storage.files import write_atomically
from tts2face.storage.temporary import NAME_INFIX, Temporary

RESULT_SUFFIX = ".json"
MAX_RESULT_BYTES = 1_000_000
REMOTE_SCHEMES = ("s3://", "gs://", "az://", "abfs://", "file://", "memory://")


@dataclass(frozen=True, slots=True)
class StoredSegment:
    """A stored segment: its files together, and when it was stored, in seconds since 1970."""

    address: str
    n_bytes: int
    stored_s: float


class Store(Protocol):
    """Segments by content address, for any number of processes."""

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

    def result(self, address: str) -> SegmentResult | None:
        """Result of a stored segment; None if it is not stored or damaged."""
        movie = self._path(address)
        try:
            if movie.stat().st_size == 0:
                return None
            content = movie.with_suffix(RESULT_SUFFIX).read_bytes()[:MAX_RESULT_BYTES]
        except OSError:
            return None
        return _parse_result(content)

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


class ObjectStore:
    """A bucket, or a folder by ``file://``, through obstore; puts are atomic."""

    def __init__(self, url: str) -> None:
        try:
            import obstore
            import obstore.store
        except ImportError as missing:
            raise BackendError("stores by URL need the package obstore; pip install 'tts2face[batch]'") from missing
        self._obstore = obstore
        if url.startswith("file://"):
            Path(url.removeprefix("file://")).mkdir(parents=True, exist_ok=True)
        try:
            self._store: Any = obstore.store.from_url(url)
        except (ValueError, obstore.exceptions.BaseError) as wrong:
            raise InputError(f"cannot open the store {url} ({wrong}); check the URL and its credentials") from wrong

    def result(self, address: str) -> SegmentResult | None:
        """Result of a stored segment; None if it is not stored."""
        try:
            with self._errors(address):
                return _parse_result(bytes(self._obstore.get(self._store, self._name(address, RESULT_SUFFIX)).bytes()))
        except FileNotFoundError:
            return None

    def put(self, address: str, movie: Path, result: SegmentResult) -> None:
        """Upload a movie, then its result."""
        with self._errors(address):
            self._obstore.put(self._store, self._name(address, SEGMENT_SUFFIX), movie)
            self._obstore.put(self._store, self._name(address, RESULT_SUFFIX), json.dumps(result.as_json()).encode())
        movie.unlink(missing_ok=True)

    def fetch(self, address: str, folder: Path) -> Path:
        """Path of a copy of a stored segment."""
        path = folder / f"{address}{SEGMENT_SUFFIX}"
        if not path.exists():
            with self._errors(address), Temporary(path) as temporary:
                found = self._obstore.get(self._store, self._name(address, SEGMENT_SUFFIX))
                with temporary.path.open("wb") as file:
                    for block in found.stream():
                        file.write(block)
                temporary.replace(path)
        return path

    def addresses(self) -> Iterator[str]:
        """Addresses of all stored segments."""
        for page in self._obstore.list(self._store):
            for entry in page:
                path = str(entry["path"])
                if path.endswith(RESULT_SUFFIX):
                    yield Path(path).stem

    def entries(self) -> Iterator[StoredSegment]:
        """All stored segments with their sizes and times."""
        files = (entry for page in self._obstore.list(self._store) for entry in page)
        yield from sum_files(
            (Path(entry["path"]).stem, entry["size"], entry["last_modified"].timestamp())
            for entry in files
            if entry["path"].endswith((SEGMENT_SUFFIX, RESULT_SUFFIX))
        )

    def remove(self, address: str) -> None:
        """Remove a segment, its result first."""
        for suffix in (RESULT_SUFFIX, SEGMENT_SUFFIX):
            with contextlib.suppress(FileNotFoundError), self._errors(address):
                self._obstore.delete(self._store, self._name(address, suffix))

    def scratch(self) -> Path | None:
        """Nothing local."""
        return None

    @contextlib.contextmanager
    def _errors(self, address: str) -> Iterator[None]:
        """Errors of the store as BackendError; FileNotFoundError stays."""
        try:
            yield
        except FileNotFoundError:
            raise
        except (self._obstore.exceptions.BaseError, OSError) as error:
            raise BackendError(f"the store failed for {address[:12]} ({error}); run again") from error

    @staticmethod
    def _name(address: str, suffix: str) -> str:
        return f"{address[:2]}/{address}{suffix}"


def sum_files(files: Iterable[tuple[str, int, float]]) -> Iterator[StoredSegment]:
    """Segments of files given by address, bytes and time; a segment has the time of its latest file."""
    found: dict[str, StoredSegment] = {}
    for address, n_bytes, stored_s in files:
        other = found.get(address, StoredSegment(address, 0, 0.0))
        found[address] = StoredSegment(address, other.n_bytes + n_bytes, max(other.stored_s, stored_s))
    yield from found.values()


def _parse_result(content: bytes) -> SegmentResult | None:
    """Result of its JSON; None if it is damaged, so that the segment is rendered again."""
    try:
        return result_from_json(parse_json(content.decode("utf-8"), "the result of a segment"))
    except (ValueError, TypeError, AttributeError, DataError):
        return None
