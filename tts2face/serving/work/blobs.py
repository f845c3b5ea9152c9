"""Files by the SHA-256 of their content, in a folder or a bucket. A file appears complete or not at all.

Files of jobs on this machine: fetched by their content, under names with endings.

The file of a job lies in a folder whose name is its SHA-256, and an uploaded model has its SHA-256 as its name, so that
a worker on another machine can fetch them.
"""

import contextlib
import hashlib
import os
import re
import secrets
import shutil
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, Protocol

from lexicon.errors import BackendError
from tts2face.serving.batch.object_store import ObjectStore
from tts2face.serving.batch.segment import Segment, file_hash
from tts2face.serving.batch.store import REMOTE_SCHEMES
from tts2face.session.named_models import Models
from tts2face.storage.files import translate_disk_errors, user_cache
from tts2face.storage.temporary import NAME_INFIX, Temporary

HASH = re.compile(r"[0-9a-f]{64}")
BLOCK_BYTES = 1 << 20
CACHE_BYTES = 4 << 30  # of local copies of a bucket


class MissingBlobError(BackendError):
    """There is no such file in the store."""


class BlobStore(Protocol):
    """Files by the SHA-256 of their content, for any number of processes."""

    def put(self, content: Path | bytes) -> str:
        """Store a file or bytes; its SHA-256 in hexadecimal digits. The same content may be stored twice."""

    def fetch(self, sha256: str) -> Path:
        """Local path of a stored file, whose content has been checked; it must not be changed."""

    def has(self, sha256: str) -> bool:
        """Whether a file is stored."""

    def delete(self, sha256: str) -> None:
        """Remove a file, if it is stored."""

    def entries(self) -> Iterator[tuple[str, float]]:
        """Hashes of all files, with the times at which they were stored, in seconds since 1970."""


def open_blobs(where: str | Path, name: str, *, cache: Path | None = None) -> BlobStore:
    """Files of one kind in a store.

    Parameters
    ----------
    where
        A folder, or a URL as for `tts2face.serving.batch.store.open_store`.
    name
        Kind of the files, such as ``results``: equal files of two kinds are stored and deleted independently.
    cache
        Folder of local copies of a bucket; None: one of the user's.

    Raises
    ------
    InputError, BackendError
        As `open_store`.
    """
    text = str(where)
    if text.startswith(REMOTE_SCHEMES):
        return BucketBlobs(ObjectStore(text), name, cache or user_cache() / "blobs")
    return FolderBlobs(Path(text) / name)


class FolderBlobs:
    """A local folder; files appear by rename."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        with translate_disk_errors(folder):
            folder.mkdir(parents=True, exist_ok=True)

    def put(self, content: Path | bytes) -> str:
        """Store a file or bytes.

        Raises
        ------
        BackendError
            The folder cannot be written or the disk is full.
        """
        with translate_disk_errors(self.folder), Temporary(self.folder / "new") as temporary:
            sha256 = _write(content, temporary.path)
            target = self._path(sha256)
            target.parent.mkdir(exist_ok=True)
            temporary.replace(target)
        return sha256

    def fetch(self, sha256: str) -> Path:
        """Local path of a stored file.

        Raises
        ------
        MissingBlobError
            It is not stored.
        BackendError
            It is damaged; it is removed, so that it can be stored again.
        """
        path = self._path(sha256)
        if not path.is_file():
            raise MissingBlobError(f"the file {sha256[:12]} is not in {self.folder}; make it again")
        if file_hash(path) != sha256:
            path.unlink(missing_ok=True)
            raise BackendError(f"the file {sha256[:12]} in {self.folder} was damaged; make it again")
        return path

    def has(self, sha256: str) -> bool:
        """Whether a file is stored."""
        return self._path(sha256).is_file()

    def delete(self, sha256: str) -> None:
        """Remove a file, if it is stored."""
        with translate_disk_errors(self.folder):
            self._path(sha256).unlink(missing_ok=True)

    def entries(self) -> Iterator[tuple[str, float]]:
        """Hashes of all files, with the times at which they were stored, in seconds since 1970."""
        for path in self.folder.glob("??/*"):
            with contextlib.suppress(FileNotFoundError):
                if HASH.fullmatch(path.name):
                    yield path.name, path.stat().st_mtime

    def _path(self, sha256: str) -> Path:
        return self.folder / _checked(sha256)[:2] / sha256


class BucketBlobs:
    """A bucket with local copies, of which the least recently used are removed beyond `max_bytes`."""

    def __init__(self, bucket: ObjectStore, name: str, cache: Path, max_bytes: int = CACHE_BYTES) -> None:
        self._bucket, self._name, self._max_bytes = bucket, name, max_bytes
        self._copies = FolderBlobs(cache)

    def put(self, content: Path | bytes) -> str:
        """Store a file or bytes; errors as of the bucket."""
        sha256 = self._copies.put(content)
        self._bucket.put_object(self._object(sha256), self._copies.fetch(sha256))
        self._limit(sha256)
        return sha256

    def fetch(self, sha256: str) -> Path:
        """Path of a local copy; errors as `FolderBlobs.fetch` and of the bucket."""
        with contextlib.suppress(BackendError):
            path = self._copies.fetch(sha256)
            status = path.stat()
            os.utime(path, ns=(time.time_ns(), status.st_mtime_ns))  # the time of use
            return path
        target = self._copies.folder / _checked(sha256)[:2] / sha256
        with translate_disk_errors(target):
            target.parent.mkdir(parents=True, exist_ok=True)
        try:
            self._bucket.get_object(self._object(sha256), target)
        except FileNotFoundError:
            raise MissingBlobError(f"the file {sha256[:12]} is not in {self._bucket.url}; make it again") from None
        path = self._copies.fetch(sha256)
        self._limit(sha256)
        return path

    def has(self, sha256: str) -> bool:
        """Whether a file is in the bucket."""
        return self._bucket.has_object(self._object(sha256))

    def delete(self, sha256: str) -> None:
        """Remove a file and its local copy, if there are such."""
        self._bucket.delete_object(self._object(sha256))
        self._copies.delete(sha256)

    def entries(self) -> Iterator[tuple[str, float]]:
        """Hashes of all files, with the times at which they were stored, in seconds since 1970."""
        for name, stored_s in self._bucket.list_objects(f"{self._name}/"):
            sha256 = name.rpartition("/")[2]
            if HASH.fullmatch(sha256):
                yield sha256, stored_s

    def _object(self, sha256: str) -> str:
        return f"{self._name}/{_checked(sha256)[:2]}/{sha256}"

    def _limit(self, kept: str) -> None:
        """Remove the copies that were not used for longest, but never the one that is about to be used."""
        copies = sorted(self._used(), reverse=True)
        n_bytes = 0
        for _, size, path in copies:
            n_bytes += size
            if n_bytes > self._max_bytes and path.name != kept:
                path.unlink(missing_ok=True)

    def _used(self) -> Iterator[tuple[int, int, Path]]:
        for path in self._copies.folder.glob("??/*"):
            with contextlib.suppress(OSError):
                status = path.stat()
                if NAME_INFIX not in path.name:
                    yield max(status.st_atime_ns, status.st_mtime_ns), status.st_size, path


def _checked(sha256: str) -> str:
    """The hash itself: whatever else a client may send never becomes a path."""
    if HASH.fullmatch(sha256) is None:
        raise MissingBlobError(f"{sha256[:70]!r} is no SHA-256 in hexadecimal digits; give one")
    return sha256


def _write(content: Path | bytes, target: Path) -> str:
    """Copy a file or bytes to a path; the hash of what was written."""
    if isinstance(content, bytes):
        target.write_bytes(content)
        return hashlib.sha256(content).hexdigest()
    digest = hashlib.sha256()
    with content.open("rb") as source, target.open("wb") as file:
        while block := source.read(BLOCK_BYTES):
            digest.update(block)
            file.write(block)
    return digest.hexdigest()


MODEL_PATHS = ("talker", "face", "palette", "hair", "dictionary")
REQUEST_PATHS = ("audio", "timeline", "dictionary", "voice")


def place_file(blobs: Sequence[BlobStore], sha256: str, name: str, folder: Path) -> Path:
    """Path of a file with a name in a folder; it is a link where the system has links.

    Raises
    ------
    MissingBlobError
        No store has the file.
    """
    path = folder / sha256 / Path(name).name
    if path.exists():
        return path
    found = fetch_file(blobs, sha256)
    path.parent.mkdir(parents=True, exist_ok=True)
    placed = path.with_name(f".{secrets.token_hex(8)}")  # segments that need the same file place it at the same time
    try:
        os.symlink(found.resolve(), placed)
    except OSError:  # no links here
        shutil.copyfile(found, placed)
    placed.replace(path)
    return path


def fetch_file(blobs: Sequence[BlobStore], sha256: str) -> Path:
    """Local path of a file in the first store that has it.

    Raises
    ------
    MissingBlobError
        No store has it.
    """
    for store in blobs[:-1]:
        with contextlib.suppress(MissingBlobError):
            return store.fetch(sha256)
    return blobs[-1].fetch(sha256)


def place_models(values: Mapping[str, Any], blobs: Callable[[], Sequence[BlobStore]]) -> dict[str, Any]:
    """Values of models or of a request with local paths of the uploads that another machine has named."""

    def local(value: Any) -> Any:
        name = Path(str(value)).name
        return str(fetch_file(blobs(), name)) if HASH.fullmatch(name) else value

    return _replaced(values, MODEL_PATHS, local)


def place_segment_files(
    segment: Segment, blobs: Callable[[], Sequence[BlobStore]], folder: Callable[[], Path]
) -> Segment:
    """The segment with local paths of the files that were placed by `place_file` elsewhere."""

    def local(value: Any) -> Any:
        path = Path(str(value))
        if HASH.fullmatch(path.name):
            return str(fetch_file(blobs(), path.name))
        if HASH.fullmatch(path.parent.name) is None:
            return value
        return str(place_file(blobs(), path.parent.name, path.name, folder()))

    request = _replaced(segment.request, REQUEST_PATHS, local)
    picture = _replaced(segment.picture, ("background",), local)
    models = Models(**_replaced(asdict(segment.models), MODEL_PATHS, local))
    return replace(segment, request=request, picture=picture, models=models)


def _replaced(values: Mapping[str, Any], names: Sequence[str], local: Callable[[Any], Any]) -> dict[str, Any]:
    return {name: local(value) if name in names and value is not None else value for name, value in values.items()}
