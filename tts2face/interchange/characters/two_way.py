"""Shapes whose names state two directions, such as ``JawSide-Side``: their signs are read from the mesh."""

import re
from dataclasses import replace

from tts2face.interchange.characters.character import Character
from tts2face.interchange.characters.shapes import ShapeMapping

# Names of DAZ and MB-Lab; which of the two directions weight 1 has differs between versions and exporters.
TWO_WAY = re.compile("Side-?Side|In-?Out|Out-?In|Up-?Down|Raise-?Lower|Horiz")
# Axis (x to the character's left, y up, z ahead) along which a shape moves the face, and its sign.
TOWARDS = {
    "jawLeft": (0, 1), "jawRight": (0, -1), "mouthLeft": (0, 1), "mouthRight": (0, -1), "jawForward": (2, 1),
    "tongueOut": (2, 1), "tongueUp": (1, 1), "mouthRollUpper": (2, -1), "mouthRollLower": (2, -1),
}  # fmt: skip


def with_directions(mapping: ShapeMapping, character: Character) -> ShapeMapping:
    """Mapping in which shapes of two directions move the vertices as the shapes of the face do."""
    turned = dict(mapping)
    for shape, (axis, sign) in TOWARDS.items():
        sources = mapping.get(shape, ())
        moved = sum(source.gain * character.drift(source.name)[axis] for source in sources)
        if sources and all(TWO_WAY.search(source.name) for source in sources) and sign * moved < 0:
            turned[shape] = tuple(replace(source, gain=-source.gain) for source in sources)
    return turned
