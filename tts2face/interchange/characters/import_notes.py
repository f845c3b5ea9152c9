"""Sentences of an import about what was changed, replaced or left out of a character."""

from collections.abc import Mapping, Sequence

import numpy as np

from tts2face.interchange.characters.character import Character
from tts2face.interchange.characters.head_mesh import HeadMesh, mapped_targets
from tts2face.interchange.characters.part_names import shells_before_eyes
from tts2face.interchange.characters.shape_names import combinations_of_shapes
from tts2face.interchange.characters.shapes import ShapeMapping
from tts2face.interchange.characters.surface import is_plain
from tts2face.models.landmarks import EYE_OUTER_LEFT, EYE_OUTER_RIGHT
from tts2face.numeric.arrays import FloatArray

ASIDE_DEG = 10.0  # from an axis, at which a head looks along it
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


def place_notes(turn: FloatArray, landmarks: Mapping[int, FloatArray], eyes_apart_mm: float) -> list[str]:
    """Notes about what was guessed of a head that was found in pictures: axes and unit of its file.

    `turn` (3, 3) leads from the file's axes to a head that looks along z; `landmarks` are places (3,) in units of the
    file, and `eyes_apart_mm` is the distance of the outer corners of the face's eyes.
    """
    eyes_apart = float(np.linalg.norm(landmarks[EYE_OUTER_LEFT] - landmarks[EYE_OUTER_RIGHT]))
    ahead, up = turn[2], turn[1]
    (front, aside), (high, tilted) = _nearest_axis(ahead), _nearest_axis(up)
    notes = []
    if (front, high) != ("+z", "+y") or max(aside, tilted) > ASIDE_DEG:
        off = f", {max(aside, tilted):.0f} degrees off" if max(aside, tilted) > ASIDE_DEG else ""
        option = "--front sets its axis" if high == "+y" else "a table of --landmarks sets its place"
        notes.append(f"by its pictures the head looks along {front} with {high} up{off}, and is turned; {option}")
    if not np.isclose(eyes_apart * 1000.0, eyes_apart_mm, rtol=0.15):
        notes.append(
            f"its unit is not the metre (the eyes' outer corners are {eyes_apart:.3g} units apart): it is scaled to "
            f"{eyes_apart_mm:.0f} mm, as the shipped head; scale the file to metres to keep its size"
        )
    return notes


def _nearest_axis(direction: FloatArray) -> tuple[str, float]:
    """Name of the axis nearest to a unit vector (3,), and the angle between them in degrees."""
    number = int(np.abs(direction).argmax())
    angle = float(np.degrees(np.arccos(np.clip(abs(direction[number]), 0.0, 1.0))))
    return ("+" if direction[number] > 0 else "-") + "xyz"[number], angle


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
