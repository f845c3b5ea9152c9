"""Names of face shapes in other programs, and the ARKit shapes that they stand for.

ARKit's 52 names in any spelling, Oculus visemes, VRM expressions, and an editable table of further names.
"""

import re
from collections.abc import Iterable, Mapping
from functools import cache
from importlib.resources import files

from tts2face.interchange.characters.shapes import SIDES, ShapeMapping, ShapeSource, with_sides

TABLE = "shape_names.tsv"
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
# Shapes of whole vowels and consonants, used for speech by characters without jawOpen. Left: name in the face.
VISEMES = {
    "aa": ("viseme aa", "aa", "a", "fcl mth a", "mth a"),
    "ih": ("viseme ih", "viseme i", "ih", "i", "fcl mth i", "mth i"),
    "ou": ("viseme ou", "viseme u", "ou", "u", "fcl mth u", "mth u"),
    "ee": ("viseme e", "viseme ee", "ee", "e", "fcl mth e", "mth e"),
    "oh": ("viseme oh", "viseme o", "oh", "o", "fcl mth o", "mth o"),
    "ff": ("viseme ff",),
    "ch": ("viseme ch",),
    "ss": ("viseme ss",),
    "rr": ("viseme rr",),
    "th": ("viseme th",),
    "pp": ("viseme pp",),
}
VISEME_PREFIX = "mouthViseme_"  # the prefix marks shapes that speech moves
_WORD = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+")
_SIDE_WORDS = {"l": "Left", "left": "Left", "lf": "Left", "r": "Right", "right": "Right", "rt": "Right"}
Key = tuple[str, str]


def guess_mapping(names: Iterable[str]) -> ShapeMapping:
    """Shapes that the names of morph targets and expressions stand for, the best name of each.

    Names of ARKit win over other names; visemes are used only where no name opens the jaw.
    """
    given = list(dict.fromkeys(names))
    found: dict[str, list[ShapeSource]] = {}
    for guess in (_arkit_shapes, _table_shapes):
        named: dict[str, list[ShapeSource]] = {}
        for name in given:
            for shape in guess(name):
                named.setdefault(shape, []).append(ShapeSource(name, 1.0))
        found = {shape: _preferred(shape, sources) for shape, sources in named.items()} | found
    # a character without ARKit's jaw speaks by visemes (VRM: A, I, U, E, O)
    if "jawOpen" not in found:
        found |= _viseme_shapes(given)
    return with_sides({shape: tuple(sources) for shape, sources in sorted(found.items())})


def name_key(name: str) -> Key:
    """Words of a name in lower case without its path, prefix and side; and the side, ``Left``, ``Right`` or none."""
    words = [word.lower() for word in _WORD.findall(re.split(r"[.:|/]", name)[-1])]
    sides = {_SIDE_WORDS[word] for word in words if word in _SIDE_WORDS}
    rest = " ".join(word for word in words if word not in _SIDE_WORDS)
    return rest, sides.pop() if len(sides) == 1 else ""


def _tails(name: str) -> list[Key]:
    """Keys of a name with fewer and fewer of its first words, which may be a prefix; at least two words or a side."""
    words, side = name_key(name)
    parts = words.split(" ")
    return [(" ".join(parts[first:]), side) for first in range(max(len(parts) - (not side), 1))]


def _arkit_shapes(name: str) -> tuple[str, ...]:
    known = _arkit_keys()
    return next((known[key] for key in _tails(name) if key in known), ())


def _table_shapes(name: str) -> tuple[str, ...]:
    table = _name_table()
    for words, side in _tails(name):
        if words in table:
            stems = table[words]
            return tuple(shape for stem in stems for shape in _shapes_of_stem(stem, side))
    return ()


def _shapes_of_stem(stem: str, side: str) -> tuple[str, ...]:
    if stem not in SIDED:
        return (stem,)
    return (stem + side,) if side else tuple(stem + each for each in SIDES)


@cache
def _arkit_keys() -> Mapping[Key, tuple[str, ...]]:
    """ARKit shapes by key; a key without the side stands for both shapes, one with a side for an unsided shape."""
    keys: dict[Key, tuple[str, ...]] = {}
    for stem in UNSIDED:
        words, _ = name_key(stem)
        keys |= {(words, side): (stem,) for side in ("", *SIDES)}
    for stem in SIDED:
        words, _ = name_key(stem)
        keys |= {(words, side): (stem + side,) for side in SIDES}
        if stem not in ("jaw", "mouth"):
            keys[words, ""] = tuple(stem + side for side in SIDES)
    return keys


@cache
def _name_table() -> Mapping[str, tuple[str, ...]]:
    rows = files("tts2face.interchange.characters").joinpath(TABLE).read_text("utf-8").splitlines()
    cells = [row.split("\t") for row in rows if row and not row.startswith("#")][1:]
    return {words: tuple(stems.split(" ")) for words, stems in cells}


def _preferred(shape: str, sources: list[ShapeSource]) -> list[ShapeSource]:
    """Sources of one shape: those of its own side; for an unsided shape an unsided one, or one of each side."""
    by_side: dict[str, ShapeSource] = {}
    for source in sources:
        by_side.setdefault(name_key(source.name)[1], source)
    own = next((side for side in SIDES if shape.endswith(side)), "")
    if own in by_side:
        return [by_side[own]]
    return [by_side[""]] if "" in by_side else [by_side[side] for side in SIDES if side in by_side]


def _viseme_shapes(names: list[str]) -> dict[str, list[ShapeSource]]:
    keys = {" ".join(name_key(name)[0].split(" ")): name for name in reversed(names)}
    found = {}
    for viseme, spellings in VISEMES.items():
        source = next((keys[spelling] for spelling in spellings if spelling in keys), None)
        if source is not None:
            found[VISEME_PREFIX + viseme] = [ShapeSource(source, 1.0)]
    return found
