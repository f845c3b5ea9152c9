"""Kinds of a character's parts by the names of meshes, nodes and materials."""

import re

from tts2face.interchange.characters.character import OPAQUE, Character, MaterialPiece

_KINDS = {
    "lashes": re.compile(r"lash", re.I),
    "brows": re.compile(r"brow", re.I),
    "teeth": re.compile(r"teeth|tooth|dent(?:al|ure)", re.I),
    "tongue": re.compile(r"tongue|gum", re.I),
    "hair": re.compile(r"hair|beard|mustache|moustache", re.I),
    "eyes": re.compile(r"eye(?!.?(?:lid|shadow|socket))|cornea|sclera|iris|pupil", re.I),  # unless speech moves it
}
# Transparent shells before the eye, by the names of Unreal, MetaHuman, Character Creator and DAZ; programs that lose
# their transparency write them opaque, and they would cover the eye as skin.
_SHELLS = re.compile(
    r"lacrimal|tear.?(?:line|fluid|film)|(?<![a-z])tears?(?![a-z])|eye.?(?:occlusion|blend|shell|edge|moisture|wet)",
    re.I,
)


def kind_by_name(piece: MaterialPiece, character: Character) -> str | None:
    """Kind that the names of a piece and of its material tell; None where they tell none."""
    name = f"{piece.name} {character.materials[piece.material].name}"
    return next((kind for kind, pattern in _KINDS.items() if pattern.search(name)), None)


def shells_before_eyes(character: Character) -> list[int]:
    """Pieces that lie before the eyes and whose transparency the file has lost."""
    return [
        number
        for number, piece in enumerate(character.pieces)
        if character.materials[piece.material].alpha_mode == OPAQUE
        and _SHELLS.search(f"{piece.name} {character.materials[piece.material].name}")
    ]
