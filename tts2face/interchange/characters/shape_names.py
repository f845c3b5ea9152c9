"""Shapes of a face that the names of a character stand for: ARKit's, of another program's family, and visemes."""

from collections.abc import Iterable, Mapping

from tts2face.face.combinations import combination_name
from tts2face.face.lip_constraints import SPEECH_SHAPE_PREFIXES
from tts2face.face.stand_in import VISEME_PREFIX
from tts2face.interchange.characters.families import (
    arkit_family,
    combinations,
    general_family,
    program_families,
    recognised_families,
)
from tts2face.interchange.characters.name_words import key, name_words
from tts2face.interchange.characters.shapes import SIDES, ShapeMapping, ShapeSource, with_sides

SIDED = (
    "browDown", "browOuterUp", "cheekSquint", "eyeBlink", "eyeLookDown", "eyeLookIn", "eyeLookOut", "eyeLookUp",
    "eyeSquint", "eyeWide", "jaw", "mouth", "mouthDimple", "mouthFrown", "mouthLowerDown", "mouthPress", "mouthSmile",
    "mouthStretch", "mouthUpperUp", "noseSneer",
)  # fmt: skip
UNSIDED = (
    "browInnerUp", "cheekPuff", "jawForward", "jawOpen", "mouthClose", "mouthFunnel", "mouthPucker", "mouthRollLower",
    "mouthRollUpper", "mouthShrugLower", "mouthShrugUpper", "tongueOut",
)  # fmt: skip
ARKIT_SHAPES = tuple(sorted([*(stem + side for stem in SIDED for side in SIDES), *UNSIDED]))
MAX_COMBINATIONS = 64  # that are driven: each costs as much memory as a shape
# Visemes of lips that touch serve beside ARKit's jaw where the shapes are missing that roll or press the lips.
CONTACT_VISEMES = {"mouthViseme_ff": ("mouthRollLower",), "mouthViseme_pp": ("mouthPressLeft", "mouthRollUpper")}


def guess_mapping(names: Iterable[str]) -> ShapeMapping:
    """Shapes that the names of morph targets and expressions stand for.

    Exact names of ARKit win over the whole list, then those of a program whose family the names are, the one with most
    of them first, then ARKit's after a prefix, then names of no one program. Combinations of shapes are none of them.
    Visemes are used where no name opens the jaw or where they are more than the other shapes of the mouth; of the
    others those of `CONTACT_VISEMES`.
    """
    given = list(dict.fromkeys(names))
    left_alone = set(combinations_of_shapes(given))
    plain = [name for name in given if name not in left_alone]
    arkit = arkit_family(SIDED, UNSIDED)
    exact = {key(name_words(name)): name for name in reversed(plain)}
    found = arkit.sources({own: exact[own] for own in arkit.keys & exact.keys()})
    for family, matches in recognised_families(plain):
        used = {source.name for sources in found.values() for source in sources}
        rest = {own: name for own, name in matches.items() if name not in used}
        found = family.sources(rest) | found
    for family in (arkit, general_family()):
        found = family.sources(family.matches(plain)) | found
    # a character without ARKit's jaw speaks by visemes (VRM: A, I, U, E, O)
    if _speaks_by_jaw(found):
        found = {
            shape: sources
            for shape, sources in found.items()
            if not shape.startswith(VISEME_PREFIX) or found.keys().isdisjoint(CONTACT_VISEMES.get(shape, found))
        }
    return with_sides(dict(sorted(found.items())))


def _speaks_by_jaw(found: Mapping[str, object]) -> bool:
    """Whether jaw and lips are enough for speech: a mouth that opens and smiles beside fifteen visemes is not."""
    visemes = [shape for shape in found if shape.startswith(VISEME_PREFIX)]
    spoken = [shape for shape in found if shape.startswith(SPEECH_SHAPE_PREFIXES)]
    return "jawOpen" in found and len(visemes) <= len(spoken) - len(visemes)


def combinations_of_shapes(names: Iterable[str]) -> dict[str, tuple[str, ...]]:
    """Names of shapes that correct or combine others, such as ``browDown_jawOpen``, and the keys of these."""
    families = (arkit_family(SIDED, UNSIDED), general_family(), *program_families())
    return combinations(names, frozenset().union(*(family.keys for family in families)))


def with_combinations(mapping: ShapeMapping, names: Iterable[str]) -> ShapeMapping:
    """Mapping with shapes for combinations of two or more others, all of which it drives as they are."""
    given = list(names)
    plain = {key(name_words(name)): name for name in given}
    driven = {
        source.name: shape
        for shape, sources in mapping.items()
        for source in sources
        if source.gain == 1.0 and not source.side
    }
    added: dict[str, tuple[ShapeSource, ...]] = {}
    for name, parts in combinations_of_shapes(given).items():
        shapes = [driven.get(plain.get(part, "")) for part in parts]
        if len(shapes) > 1 and all(shapes) and len(added) < MAX_COMBINATIONS:
            added[combination_name(filter(None, shapes))] = (ShapeSource(name),)
    return {**mapping, **added}
