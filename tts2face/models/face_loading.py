"""Loading of a face by name, with its hair."""

from pathlib import Path

from lexicon.errors import DataError, InputError
from tts2face.models.face import Face, Hairdo
from tts2face.models.face_file import KIND, read_face
from tts2face.models.face_names import BALD
from tts2face.models.hair import attach_hair
from tts2face.models.hair_file import load_hair
from tts2face.models.hair_tint import tint_hair
from tts2face.models.light import Lamps
from tts2face.models.lit_hair import LitHair, wear_hair
from tts2face.models.named_colours import parse_hair_colour
from tts2face.processes.shared import Shared, file_state
from tts2face.storage.shipped import SHIPPED_FOLDER, find_file

_FACES: Shared[Face] = Shared()


def load_face(
    name: str, identity: str | None = None, *, hair: str | None = None, hair_color: str | None = None
) -> Face:
    """A face with its hair. All who load the same one share it; files that have changed are read again.

    Parameters
    ----------
    name
        Shipped face (head, ada), or the path of a ``.face`` file.
    identity
        Preset of the face's age, sex and ancestry.
    hair
        Haircut: one that `tts2face.haircuts` lists for the face, ``bald`` for a head, or the path of a ``.hair`` file;
        None for the face's own.
    hair_color
        Name that `tts2face.hair_colors` lists, or #rrggbb; None for the face's own.

    Raises
    ------
    InputError
        There is no such face, identity, haircut or colour, or no haircut fits the face.
    DataError
        A file is damaged, or the haircut belongs to another kind of head.
    """
    path = find_file(name, KIND)
    of_hair = SHIPPED_FOLDER if hair is None or not Path(hair).suffix else Path(hair)  # that of a face is shipped
    key = (file_state(path), file_state(of_hair), identity, hair, hair_color)
    return _FACES.get(key, lambda: _read_face(name, path, identity, hair, hair_color))


def _read_face(name: str, path: Path, identity: str | None, hair: str | None, hair_color: str | None) -> Face:
    face = read_face(path, identity, checks_pictures=path.parent != SHIPPED_FOLDER)
    if face.hairdo is None:
        if hair not in (None, BALD) or hair_color is not None:
            raise InputError(f"no haircut fits the face {name}; remove --hair and --hair-color, or choose another face")
        return face
    chosen = Hairdo(hair or face.hairdo.haircut, hair_color or face.hairdo.colour)
    if not isinstance(face.light, Lamps):
        return _lit_face(face, chosen)
    if chosen.haircut == BALD:
        parse_hair_colour(chosen.colour)
        return face
    cards = load_hair(chosen.haircut)
    if isinstance(cards, LitHair):
        raise DataError(f"the haircut {chosen.haircut} is one of the face {cards.face}; choose that face")
    return attach_hair(face, cards, chosen.colour)


def _lit_face(face: Face, chosen: Hairdo) -> Face:
    """A face with light of its own, which has a haircut and a colour in its file, with chosen ones."""
    own, name = face.hairdo or chosen, str(face.metadata.get("name", ""))
    if chosen.haircut != own.haircut:
        hair = load_hair(chosen.haircut, name, own.haircut)
        if not isinstance(hair, LitHair):
            raise DataError(f"the haircut {chosen.haircut} is for heads; choose another face or one of its haircuts")
        face = wear_hair(face, hair)
    return face if chosen.colour == own.colour else tint_hair(face, chosen.colour)
