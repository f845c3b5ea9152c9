"""Writing of imported faces, checked before they appear."""

from pathlib import Path

from lexicon.errors import BackendError, DataError
from tts2face.interchange.characters.binding import KEY, character_file, read_binding
from tts2face.models.face import Face
from tts2face.models.face_file import FORMAT_VERSION, KIND, read_face, write_face
from tts2face.models.person import PERSON, parse_person
from tts2face.storage.temporary import Temporary
from tts2face.storage.tensors import read_tensors, write_tensors


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


def relink_face(path: str | Path, character: str | Path) -> Path:
    """Write the new place of a moved character into the ``.face`` file that was imported from it; that place.

    Raises
    ------
    InputError
        There is no such face, or it was not imported from a .glb, .gltf or .vrm file.
    DataError
        The face is damaged, the character is missing, or its content is not that of the import.
    BackendError
        The file cannot be written.
    """
    path = Path(path)
    place = character_file(read_binding(read_face(path)), character).resolve()
    arrays, header = read_tensors(path, KIND, FORMAT_VERSION)
    header["metadata"][KEY]["file"] = str(place)
    write_tensors(path, KIND, FORMAT_VERSION, arrays, header, is_packed=True)
    return place


def state_person(path: str | Path, person: str) -> None:
    """Write sex and age of who is shown into a ``.face`` file, by which a voice is chosen.

    Raises
    ------
    InputError
        There is no such face or person (`tts2face.models.person.parse_person`).
    DataError
        The face is damaged.
    BackendError
        The file cannot be written.
    """
    parse_person(person)
    arrays, header = read_tensors(Path(path), KIND, FORMAT_VERSION)
    header["metadata"][PERSON] = person
    write_tensors(Path(path), KIND, FORMAT_VERSION, arrays, header, is_packed=True)


def _check(written: Path, path: Path) -> None:
    try:
        read_face(written)
    except DataError as wrong:
        raise DataError(str(wrong).replace(str(written), str(path))) from wrong
