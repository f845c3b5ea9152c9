"""Sentences of an import about what was changed, replaced or left out of a character."""

from collections.abc import Sequence

import numpy as np

from tts2face.interchange.characters.character import Character
from tts2face.interchange.characters.head_mesh import HeadMesh, mapped_targets
from tts2face.interchange.characters.part_names import shells_before_eyes
from tts2face.interchange.characters.shape_names import combinations_of_shapes
from tts2face.interchange.characters.shapes import ShapeMapping
from tts2face.interchange.characters.surface import is_plain

MAX_NAMES, MAX_LETTERS = 12, 40  # names in a sentence, and letters of each


def some_of(names: Sequence[str], most: int = MAX_NAMES) -> str:
    """The first `most` of many names, and how many there are besides."""
    shown = ", ".join(name[:MAX_LETTERS] for name in names[:most]) or "no shapes"
    return shown + (f" and {len(names) - most} more" if len(names) > most else "")


def name_notes(character: Character, mapping: ShapeMapping) -> list[str]:
    """Notes about shapes that move nothing, and about combinations of shapes."""
    empty, driven = character.still_names, {source.name for sources in mapping.values() for source in sources}
    notes = [f"shapes that move no vertex are as good as missing: {some_of(empty)}"] if empty else []
    combined = list(combinations_of_shapes(character.moving_names))
    for is_driven, what in ((True, "get the products of their weights"), (False, "are left alone")):
        some = [name for name in combined if (name in driven) == is_driven]
        notes += [f"shapes that combine others {what}: {some_of(some)}"] if some else []
    return notes


def pose_notes(character: Character, mapping: ShapeMapping) -> list[str]:
    """A note about default weights of the file, which the face at rest does not have."""
    driven = mapped_targets(character, mapping)
    posed = {t: weight for piece in character.pieces for t, weight in piece.defaults.items() if t in driven}
    largest = sorted(posed, key=lambda target: -abs(posed[target]))[:3]
    named = ", ".join(f"{character.target_names[target][:40]} {posed[target]:.2f}" for target in largest)
    return (
        [f"the file poses {len(posed)} of the mapped shapes ({named}); the face at rest has none of them"]
        if posed
        else []
    )


def colour_notes(character: Character, head: HeadMesh) -> list[str]:
    """Notes about white materials, whose colour is replaced, and about shells that are left out."""
    shells = set(shells_before_eyes(character)) & set(head.piece_of.tolist())
    used = [character.pieces[number] for number in np.unique(head.piece_of).tolist() if number not in shells]
    plain = {
        piece.material for piece in used if piece.colours is None and is_plain(character.materials[piece.material])
    }
    names = sorted(character.materials[number].name for number in plain)
    notes = [f"the material {name[:60]!r} is white without an image; plain colours replace it" for name in names]
    if shells:
        left_out = sorted({character.materials[character.pieces[number].material].name for number in shells})
        notes.append(f"shells before the eyes that are not transparent are left out: {some_of(left_out)}")
    return notes
