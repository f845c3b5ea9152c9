"""Loading of a face by name, with its hair."""

from lexicon.errors import InputError
from tts2face.models.face import Face, Hairdo
from tts2face.models.face_file import KIND, read_face
from tts2face.models.hair import BALD, attach_hair, parse_hair_colour
from tts2face.models.hair_file import load_hair
from tts2face.storage.files import FORMER, SHIPPED_FOLDER, find_file


def load_face(
    name: str, identity: str | None = None, *, hair: str | None = None, hair_color: str | None = None
) -> Face:
    """Load a face with its hair.

    Parameters
    ----------
    name
        Shipped face (head, ada), or the path of a ``.face`` file.
    identity
        Preset of the face's age, sex and ancestry.
    hair
        Haircut: ``bald``, one that `tts2face.haircuts` lists, or the path of a ``.hair`` file; None for the face's own.
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
    face = read_face(path, identity, checks_pictures=path.parent != SHIPPED_FOLDER)
    if name in FORMER[KIND]:
        return face  # options of its hair are those of the former face
    if face.hairdo is None:
        if hair not in (None, BALD) or hair_color is not None:
            raise InputError(f"no haircut fits the face {name}; remove --hair and --hair-color, or choose another face")
        return face
    chosen = Hairdo(hair or face.hairdo.haircut, hair_color or face.hairdo.colour)
    if chosen.haircut == BALD:
        parse_hair_colour(chosen.colour)
        return face
    return attach_hair(face, load_hair(chosen.haircut), chosen.colour)
