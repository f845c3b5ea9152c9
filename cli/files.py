"""Text files that appear whole or not at all."""

import os
import tempfile
from pathlib import Path

from lexicon.errors import BackendError


def write_beside(path: Path, text: str) -> None:
    """Write a text beside `path`, then rename it.

    Raises
    ------
    BackendError
        The folder cannot be written or the disk is full.
    """
    beside = None
    try:
        handle, beside = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            file.write(text)
        os.chmod(beside, 0o644)
        os.replace(beside, path)
    except OSError as refused:
        if beside is not None:
            Path(beside).unlink(missing_ok=True)
        raise BackendError(f"cannot write {path}: {refused.strerror}; choose another folder") from refused
