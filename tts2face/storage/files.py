"""Atomic writing of files, and errors of the disk."""

import contextlib
import errno
import os
from collections.abc import Iterator
from pathlib import Path

from lexicon.errors import BackendError
from tts2face.storage.temporary import Temporary


def write_atomically(path: Path, content: bytes) -> None:
    """Write a file atomically: to a temporary file in the same folder, which is then renamed to `path`.

    Raises
    ------
    BackendError
        The folder cannot be written or the disk is full.
    """
    try:
        with Temporary(path) as temporary:
            temporary.path.write_bytes(content)
            temporary.replace(path)
    except OSError as error:
        raise BackendError(
            f"cannot write {path}: {error.strerror}; free some space or choose another folder"
        ) from error


@contextlib.contextmanager
def translate_disk_errors(path: Path) -> Iterator[None]:
    """Translate errors of the operating system into a `BackendError` with the reason.

    Raises
    ------
    BackendError
        An OSError occurred within the block.
    """
    try:
        yield
    except OSError as error:
        reason = os.strerror(error.errno) if error.errno else str(error)
        raise BackendError(f"cannot write {path}: {reason}; free some space or choose another folder") from error


def is_disk_full(error: BaseException) -> bool:
    """Whether an error says that a disk, or the share of it that a user may have, is full."""
    return isinstance(error, OSError) and error.errno in {errno.ENOSPC, errno.EDQUOT}
