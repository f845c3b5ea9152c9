"""Writing of imported faces, checked before they appear."""

from pathlib import Path

from lexicon.errors import BackendError, DataError
from tts2face.models.face import Face
from tts2face.models.face_file import read_face, write_face
from tts2face.storage.temporary import Temporary


def save_face(path: str | Path, face: Face) -> None:
    """Write a face to a ``.face`` file, which appears when its content has been read back and checked.

    Raises
    ------
    DataError
        The face breaks a rule of the format, for example too many vertices times shapes.
    BackendError
        The file cannot be written.
    """
    path = Path(path)
    try:
        with Temporary(path) as temporary:
            write_face(temporary.path, face)
            _check(temporary.path, path)
            temporary.replace(path)
    except OSError as error:
        raise BackendError(
            f"cannot write {path}: {error.strerror}; free some space or choose another folder"
        ) from error


def _check(written: Path, path: Path) -> None:
    try:
        read_face(written)
    except DataError as wrong:
        raise DataError(str(wrong).replace(str(written), str(path))) from wrong
