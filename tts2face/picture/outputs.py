"""Output paths: their kind, their checks, and the temporary file or folder that replaces them when complete."""

import os
from pathlib import Path

from lexicon.errors import InputError
from tts2face.picture.png_folder import is_png_folder
from tts2face.storage.files import translate_disk_errors
from tts2face.storage.output_paths import MOVIE_SUFFIXES, check_name
from tts2face.storage.temporary import Temporary

FILE_SUFFIXES = MP4, WEBM, MOV, GIF = MOVIE_SUFFIXES
FOLDER = ""


def output_kind(path: Path | str) -> str:
    """Kind of an output path: one of `FILE_SUFFIXES`, or `FOLDER`."""
    suffix = Path(path).suffix.lower()
    if str(path).endswith(("/", os.sep)) or suffix == "" or (suffix not in FILE_SUFFIXES and Path(path).is_dir()):
        return FOLDER
    if suffix not in FILE_SUFFIXES:
        raise InputError(
            f"{path} has the unknown suffix {suffix}; give one of {', '.join(FILE_SUFFIXES)}, "
            "a folder without a suffix for .png pictures, or a suffix that `tts2face formats` lists"
        )
    return suffix


def check_output(path: Path | str) -> Path:
    """Checked path of an output.

    Raises
    ------
    InputError
        The suffix is unknown, the parent folder does not exist, the name is only a suffix or too long, or the path is
        a folder of other files.
    BackendError
        The parent folder cannot be written.
    """
    output = Path(path)
    check_name(output)
    kind = output_kind(path)
    if kind == FOLDER and output.exists() and not (output.is_dir() and is_png_folder(output)):
        raise InputError(f"{output} contains files other than the pictures of a clip; choose another folder")
    if kind != FOLDER and output.is_dir():
        raise InputError(f"{output} is a folder; choose another name")
    return output


def make_temporary(path: Path, kind: str) -> Temporary:
    """New, empty, hidden file or folder in the same folder as a path.

    Raises
    ------
    BackendError
        The folder cannot be written.
    """
    with translate_disk_errors(path):
        return Temporary(path, is_folder=kind == FOLDER)


def move_into_place(temporary: Temporary, path: Path) -> None:
    """Rename a temporary file or folder to `path`, replacing what exists there.

    Raises
    ------
    BackendError
        The folder cannot be written.
    """
    with translate_disk_errors(path):
        temporary.replace(path)
