"""Files by the SHA-256 of their content, in a folder or a bucket, and on this machine under names with endings.

A file appears complete or not at all. That of a job lies in a folder whose name is its SHA-256, and an uploaded model
has its SHA-256 as its name, so that a worker on another machine can fetch them.
"""

import contextlib
import os
import re
import secrets
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from lexicon.errors import BackendError
from tts2face.serving.batch.content_address import file_hash
from tts2face.serving.batch.segment import Segment
from tts2face.session.named_models import Models
from tts2face.storage.content_store import ContentStore, FolderStore, content_hash, divided, open_content_store
from tts2face.storage.files import translate_disk_errors
from tts2face.storage.user_folders import user_cache

HASH = re.compile(r"[0-9a-f]{64}")
CACHE_BYTES = 4 << 30  # of local copies of a bucket
MODEL_PATHS = ("talker", "face", "palette", "hair", "dictionary")
REQUEST_PATHS = ("audio", "timeline", "dictionary", "text_marks", "voice")


class MissingBlobError(BackendError):
    """There is no such file in the store."""


def open_blobs(where: str | Path, name: str, *, cache: Path | None = None) -> "BlobStore":
    """Files of one kind in a store.

    Parameters
    ----------
    where
        A folder, or a URL as for `tts2face.storage.content_store.open_content_store`.
    name
        Kind of the files, such as ``results``: equal files of two kinds are stored and deleted independently.
    cache
        Folder of local copies of a bucket; None: one of the user's.

    Raises
    ------
    InputError, BackendError
        As `open_content_store`, or the folder cannot be created.
    """
    store = open_content_store(where, name)
    copies = store if isinstance(store, FolderStore) else FolderStore(cache or user_cache() / "blobs")
    with translate_disk_errors(copies.folder):
        copies.folder.mkdir(parents=True, exist_ok=True)
    return BlobStore(store, copies)


class BlobStore:
    """Files by the SHA-256 of their content, for any number of processes.

    Parameters
    ----------
    copies
        The store itself if it is local; else a folder of local copies, of which the least recently used are removed
        beyond `max_bytes`.
    """

    def __init__(self, store: ContentStore, copies: FolderStore, max_bytes: int = CACHE_BYTES) -> None:
        self._store = store
        self._copies = copies
        self._max_bytes = max_bytes

    def put(self, content: Path | bytes) -> str:
        """Store a file or bytes, of which the SHA-256 in hexadecimal digits is returned; it may be stored already.

        Raises
        ------
        BackendError
            The store cannot be used, the folder cannot be written or the disk is full.
        """
        with translate_disk_errors(self._copies.folder), self._copies.draft() as draft:
            if isinstance(content, bytes):
                draft.path.write_bytes(content)
            else:
                shutil.copyfile(content, draft.path)
            sha256 = content_hash(draft.path)
            name = divided(sha256)
            self._copies.keep(draft, name)
        if self._store is not self._copies:
            # of the copy, whose content was hashed: the file itself may change meanwhile
            self._store.add(name, self._copies.path(name))
            self._limit(sha256)
        return sha256

    def fetch(self, sha256: str) -> Path:
        """Local path of a stored file, whose content has been checked; it must not be changed.

        Raises
        ------
        MissingBlobError
            It is not stored.
        BackendError
            The store cannot be used; or the file is damaged, and removed, so that it can be stored again.
        """
        if self._store is self._copies:
            return self._local(sha256)
        # a copy that is missing or damaged is fetched again
        with contextlib.suppress(BackendError):
            path = self._local(sha256)
            self._copies.touch(divided(sha256))
            return path
        target = self._copies.path(_name(sha256))
        with translate_disk_errors(target):
            target.parent.mkdir(parents=True, exist_ok=True)
        try:
            self._store.lend(_name(sha256), target)
        except FileNotFoundError:
            raise MissingBlobError(f"the file {sha256[:12]} is not in {self._store.place}; make it again") from None
        path = self._local(sha256)
        self._limit(sha256)
        return path

    def has(self, sha256: str) -> bool:
        """Whether a file is stored."""
        return self._store.has(_name(sha256))

    def delete(self, sha256: str) -> None:
        """Remove a file and its local copy, if it is stored."""
        with translate_disk_errors(self._copies.folder):
            self._store.delete(_name(sha256))
            self._copies.delete(_name(sha256))

    def entries(self) -> Iterator[tuple[str, float]]:
        """Hashes of all files, with the times at which they were stored, in seconds since 1970."""
        for entry in self._store.entries():
            sha256 = entry.name.rpartition("/")[2]
            # a bucket may hold files of others
            if HASH.fullmatch(sha256):
                yield sha256, entry.stored_s

    def _local(self, sha256: str) -> Path:
        """Path of a file in the folder; errors as of `fetch`."""
        path, folder = self._copies.path(_name(sha256)), self._copies.place
        if not path.is_file():
            raise MissingBlobError(f"the file {sha256[:12]} is not in {folder}; make it again")
        if file_hash(path) != sha256:
            path.unlink(missing_ok=True)
            raise BackendError(f"the file {sha256[:12]} in {folder} was damaged; make it again")
        return path

    def _limit(self, kept: str) -> None:
        """Remove copies, but never the one that is about to be used."""
        self._copies.prune(max_bytes=self._max_bytes, kept=[divided(kept)])


def _name(sha256: str) -> str:
    """Name of a file by its hash: whatever else a client may send never becomes a path."""
    if HASH.fullmatch(sha256) is None:
        raise MissingBlobError(f"{sha256[:70]!r} is no SHA-256 in hexadecimal digits; give one")
    return divided(sha256)


def place_file(blobs: Sequence[BlobStore], sha256: str, name: str, folder: Path) -> Path:
    """Path of a file with a name in a folder; it is a link where the system has links."""
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
    """Local path of a file in the first store that has it."""
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
