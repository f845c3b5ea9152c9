"""Computed arrays in the user's cache folder, by a fingerprint of what they were computed from."""

import hashlib
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import BackendError, DataError, InputError
from tts2face.storage.tensors import Arrays, read_tensors, write_tensors
from tts2face.storage.user_folders import user_cache

MAX_FILES = 64  # of one kind; the oldest are removed


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


def read_cached(kind: str, version: int, name: str) -> dict[str, NDArray[Any]] | None:
    """Arrays that `write_cached` kept under a name; None without them, or if they are damaged or of another version."""
    with suppress(InputError, DataError):
        return read_tensors(_folder(kind) / name, kind, version)[0]
    return None


def write_cached(kind: str, version: int, name: str, arrays: Arrays) -> None:
    """Keep arrays under a name; a folder that cannot be written costs the next run the same time."""
    folder = _folder(kind)
    with suppress(BackendError, OSError):
        folder.mkdir(parents=True, exist_ok=True)
        write_tensors(folder / name, kind, version, arrays, {})
        files = sorted(folder.iterdir(), key=lambda path: path.stat().st_mtime)
        for path in files[:-MAX_FILES]:
            path.unlink(missing_ok=True)


def _folder(kind: str) -> Path:
    return user_cache() / kind
