"""Checks of output paths, made before the computation whose result they receive."""

import os
import re
from collections.abc import Sequence
from pathlib import Path

from lexicon.errors import BackendError, InputError

MOVIE_SUFFIXES = (".mp4", ".webm", ".mov", ".gif")
LONGEST_NAME = 255  # bytes; used if the file system does not report a limit
HIDDEN_EXTRA = 16  # bytes that the name of the temporary file adds: dots and random letters
_SUFFIX_ALONE = re.compile(r"\.\w{2,7}")


def check_name(path: Path) -> None:
    """Check that a file or folder can be created at a path.

    Raises
    ------
    InputError
        The name is only a suffix or too long, or the parent folder does not exist.
    BackendError
        The folder cannot be written.
    """
    _check_stem(path)
    try:
        is_folder = path.parent.is_dir()
    except OSError as error:
        raise InputError(f"cannot write {short_name(path)}: {error.strerror}; choose another folder") from error
    if not is_folder:
        raise InputError(f"there is no folder {path.parent} to write {path.name} to; create it first")
    longest = _longest_name(path.parent) - HIDDEN_EXTRA
    if (length := len(os.fsencode(path.name))) > longest:
        raise InputError(f"the name {short_name(path)} has {length} bytes; use at most {longest}")
    if not os.access(path.parent, os.W_OK | os.X_OK):
        raise BackendError(f"cannot write {path}: Permission denied; choose another folder")


def check_file_name(path: Path, what: str, suffixes: Sequence[str]) -> None:
    """Check that a file with one of the suffixes can be written at a path; further errors as `check_name`.

    Raises
    ------
    InputError
        The path has another suffix, or is a folder.
    """
    _check_stem(path)
    if path.suffix not in suffixes:
        raise InputError(f"{what} is written as {', '.join(suffixes)}, not {short_name(path)}")
    check_name(path)
    if path.is_dir():
        raise InputError(f"{path} is a folder; choose another name")


def short_name(path: Path) -> str:
    """Name of a path for a message, shortened to at most 60 characters."""
    return path.name if len(path.name) <= 60 else f"{path.name[:40]}...{path.name[-10:]}"


def _check_stem(path: Path) -> None:
    if _SUFFIX_ALONE.fullmatch(path.name):
        raise InputError(f"{path} is only a suffix; put a name before it, such as clip{path.name}")


def _longest_name(folder: Path) -> int:
    try:
        return os.pathconf(folder, "PC_NAME_MAX")
    except (AttributeError, OSError, ValueError):  # not available on Windows, or unknown
        return LONGEST_NAME
