"""Files that appear whole or not at all."""

import os
import tempfile
from pathlib import Path

from lexicon.errors import BackendError


def write_whole(path: Path, content: bytes) -> None:
    """Write a file beside `path`, then rename it, so that no half file is ever seen.

    Raises
    ------
    BackendError
        The folder cannot be written or the disk is full.
    """
    beside = None
    try:
        handle, beside = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
        with os.fdopen(handle, "wb") as file:
            file.write(content)
        os.chmod(beside, 0o644)
        os.replace(beside, path)
    except OSError as refused:
        if beside is not None:
            Path(beside).unlink(missing_ok=True)
        raise BackendError(
            f"cannot write {path}: {refused.strerror}; free some space or choose another folder"
        ) from refused
