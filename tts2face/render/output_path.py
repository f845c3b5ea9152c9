"""Where pictures go: a file or folder that appears under its name only when it is complete."""

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

from lexicon.errors import BackendError, InputError
from tts2face.render.png_folder import is_png_folder
from tts2face.storage.output_names import check_name
from tts2face.storage.temporary import Temporary

MP4, WEBM, GIF, FOLDER = ".mp4", ".webm", ".gif", ""
FILE_SUFFIXES = (MP4, WEBM, GIF)


def output_kind(path: Path | str) -> str:
    """What a path asks for: one of `FILE_SUFFIXES`, or `FOLDER`.

    Raises
    ------
    InputError
        The suffix is unknown.
    """
    suffix = Path(path).suffix.lower()
    if str(path).endswith(("/", os.sep)) or suffix == "" or (suffix not in FILE_SUFFIXES and Path(path).is_dir()):
        return FOLDER
    if suffix not in FILE_SUFFIXES:
        raise InputError(
            f"{path} has the unknown suffix {suffix}; give one of {', '.join(FILE_SUFFIXES)}, "
            "or a folder without a suffix for .png pictures"
        )
    return suffix


def check_output(path: Path | str) -> Path:
    """The path of what shall be written.

    Raises
    ------
    InputError
        The suffix is unknown, the folder around it does not exist, the name is only a suffix or too long, or it belongs
        to something else.
    BackendError
        The folder around it cannot be written.
    """
    where = Path(path)
    check_name(where)
    kind = output_kind(path)
    if kind == FOLDER and where.exists() and not (where.is_dir() and is_png_folder(where)):
        raise InputError(f"{where} holds other things than pictures of a clip; choose another folder")
    if kind != FOLDER and where.is_dir():
        raise InputError(f"{where} is a folder; choose another name")
    return where


def make_temporary(path: Path, kind: str) -> Temporary:
    """A new, empty, hidden file or folder beside a path.

    Raises
    ------
    BackendError
        The folder cannot be written.
    """
    with translate_disk_errors(path):
        return Temporary(path, is_folder=kind == FOLDER)


def move_into_place(beside: Temporary, path: Path) -> None:
    """Let what was written beside appear under its name, in place of what was there."""
    with translate_disk_errors(path):
        beside.replace(path)


@contextlib.contextmanager
def translate_disk_errors(path: Path) -> Iterator[None]:
    """Say in one sentence why the disk refused.

    Raises
    ------
    BackendError
        It did.
    """
    try:
        yield
    except OSError as refused:
        reason = os.strerror(refused.errno) if refused.errno else str(refused)
        raise BackendError(f"cannot write {path}: {reason}; free some space or choose another folder") from refused
