"""Computed arrays in the user's cache folder, by a fingerprint of what they were computed from."""

import hashlib
import zlib
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import BackendError, DataError, InputError
from tts2face.storage.content_store import FolderStore
from tts2face.storage.tensors import Arrays, read_tensors, write_tensors
from tts2face.storage.user_folders import user_cache

MAX_FILES = 64  # of one kind
Built = TypeVar("Built")


def fingerprint(parts: Iterable[NDArray[Any] | str]) -> str:
    """SHA-256 of arrays (their type, shape and values) and texts, in their order."""
    content = hashlib.sha256()
    for part in parts:
        if isinstance(part, str):
            content.update(f"text {len(part)} {part}".encode())
        else:
            content.update(f"array {part.dtype.str} {part.shape} ".encode())
            content.update(np.ascontiguousarray(part).tobytes())
    return content.hexdigest()


def computed_once(
    kind: str,
    version: int,
    parts: Iterable[NDArray[Any] | str],
    compute: Callable[[], Arrays],
    fits: Callable[[Arrays], bool],
) -> Arrays:
    """Arrays that follow from `parts` alone: those of the cache folder if they fit, else computed and kept there.

    `version` is raised when `compute` changes its result.
    """
    name = fingerprint(parts)
    found: Arrays | None = read_cached(kind, version, name)
    if found is None or not fits(found):
        found = compute()
        write_cached(kind, version, name, found)
    return found


def holds(kept: Arrays, wanted: Mapping[str, tuple[str, tuple[int, ...]]]) -> bool:
    """Whether arrays are those wanted by name, with their type and shape."""
    return {name: (array.dtype.str, array.shape) for name, array in kept.items()} == wanted


def read_cached(kind: str, version: int, name: str) -> dict[str, NDArray[Any]] | None:
    """Arrays that `write_cached` kept under a name; None without them, or if they are damaged or of another version."""
    return read_kept(
        _cache(kind).path(name), kind, version,
        lambda arrays, metadata: arrays if metadata.get("checksum") == _checksum(arrays) else None,
    )  # fmt: skip


def write_cached(kind: str, version: int, name: str, arrays: Arrays) -> None:
    """Keep arrays under a name; a folder that cannot be written costs the next run the same time."""
    cache = _cache(kind)
    # without a cache the next run computes again
    with suppress(BackendError, OSError):
        cache.folder.mkdir(parents=True, exist_ok=True)
        write_tensors(cache.path(name), kind, version, arrays, {"checksum": _checksum(arrays)})
        cache.touch(name)
        cache.prune(max_files=MAX_FILES)


def read_kept(
    path: Path, kind: str, version: int, build: Callable[[dict[str, NDArray[Any]], dict[str, Any]], Built | None]
) -> Built | None:
    """Result of `build` for a file's arrays and metadata; None without the file, or if it is damaged.

    A DataError or KeyError of `build` says that it is damaged.
    """
    # a damaged file of the cache is as none
    with suppress(InputError, DataError, KeyError):
        return build(*read_tensors(path, kind, version))
    return None


def _checksum(arrays: Arrays) -> int:
    """CRC-32 of the bytes of arrays, by which a damaged file is noticed."""
    found = 0
    # names in one order: a file may list its arrays in another
    for name in sorted(arrays):
        found = zlib.crc32(np.ascontiguousarray(arrays[name]).reshape(-1).view(np.uint8).data, found)
    return found


def _cache(kind: str) -> FolderStore:
    return FolderStore(user_cache() / kind)
