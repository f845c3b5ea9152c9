"""Families of names: what the shapes of one program are called, recognised by all names of a character together.

A table (`names`) has the form of a mapping: shape, source, gain. ``*`` in a shape stands for both sides, ``{L/R}`` in a
source for what a side has there, or for two sources that add up; of sources between ``|`` the first that exists counts.
Rows of one shape add up.
"""

import csv
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from itertools import chain

from tts2face.interchange.characters.name_words import Words, all_words, is_firm, key, name_words, tails
from tts2face.interchange.characters.shapes import HEADER, SIDES, ShapeSource

FOLDER = "tts2face.interchange.characters.names"
GENERAL = "general"
# Names of which a family is recognised; of tables of distinctive names one is enough, of bare vowels and numbers not.
LEAST_NAMES = 2
LEAST = {"arkit": 1, "general": 1, "oculus": 1, "vroid": 1, "facs": 1, "vrm": 1}
LEAST |= {"preston_blair": 4, "azure": 5, "numbered": 5}
LEAST_LETTERS = 3  # names of one letter, as A, I and U, that are meant as vowels
NUMBERS = ("azure", "numbered")  # only one of them is meant
COMMON_PREFIX = 3  # names after which a prefix may be followed by one word: Mouth_AI, Mouth_E, Mouth_O
MARKERS = ("corrective", "correction", "corr", "cor", "combination", "combo", "comb", "fix")
LEAST_PART = 4  # letters of the name of a part of a combination
_PATTERN = re.compile(r"\{([^/}]*)/([^}]*)\}")


@dataclass(frozen=True, slots=True)
class FamilyRow:
    """Alternatives for one source of a shape: the keys of the names that add up."""

    shape: str
    alternatives: tuple[tuple[str, ...], ...]
    gain: float


@dataclass(frozen=True, slots=True, eq=False)
class Family:
    """Names of one program."""

    name: str
    rows: tuple[FamilyRow, ...]

    @property
    def keys(self) -> frozenset[str]:
        """Keys of all names."""
        return frozenset(name for row in self.rows for names in row.alternatives for name in names)

    def matches(self, names: Sequence[str]) -> Mapping[str, str]:
        """Name of the character by key, for keys of the family; fewer than its least number of names are none."""
        known, by_prefix = self.keys, dict[str, dict[str, str]]()
        for name in names:
            found = next(((prefix, own) for prefix, own in tails(name) if own in known), None)
            if found is not None:
                by_prefix.setdefault(found[0], {}).setdefault(found[1], name)
        kept: dict[str, str] = {}
        for prefix in sorted(by_prefix, key=len):
            many = len(by_prefix[prefix]) >= COMMON_PREFIX and not all(own.isdecimal() for own in by_prefix[prefix])
            for own, name in by_prefix[prefix].items():
                if not prefix or many or is_firm(name, prefix):
                    kept.setdefault(own, name)
        letters = [own for own in kept if len(own) == 1 and own.isascii() and own.isalpha()]
        if len(letters) < LEAST_LETTERS:
            kept = {own: name for own, name in kept.items() if own not in letters}
        return kept if len(kept) >= LEAST.get(self.name, LEAST_NAMES) else {}

    def sources(self, found: Mapping[str, str]) -> dict[str, tuple[ShapeSource, ...]]:
        """Sources of each shape, of the names that `matches` found."""
        shapes: dict[str, tuple[ShapeSource, ...]] = {}
        for row in self.rows:
            named = next((names for names in row.alternatives if found.keys() & set(names)), ())
            added = tuple(ShapeSource(found[name], row.gain) for name in named if name in found)
            if added:
                shapes[row.shape] = (*shapes.get(row.shape, ()), *added)
        return shapes


@cache
def program_families() -> tuple[Family, ...]:
    """The families of programs."""
    tables = sorted(entry.name.removesuffix(".tsv") for entry in files(FOLDER).iterdir() if entry.name.endswith(".tsv"))
    return tuple(_read(name) for name in tables if name != GENERAL)


@cache
def general_family() -> Family:
    """Names of no one program."""
    return _read(GENERAL)


@cache
def arkit_family(sided: tuple[str, ...], unsided: tuple[str, ...]) -> Family:
    """ARKit's names in any spelling; one for both sides, or two of an undivided shape, too."""
    rows = [("".join((stem, "*")), f"{stem}_{{L/R}}|{stem}") for stem in sided if stem not in ("jaw", "mouth")]
    rows += [(f"{stem}*", f"{stem}_{{L/R}}") for stem in ("jaw", "mouth")]
    rows += [(stem, f"{stem}|{stem}_{{L/R}}") for stem in unsided]
    return Family("arkit", tuple(chain.from_iterable(_rows(shape, source, 1.0) for shape, source in rows)))


def recognised_families(names: Sequence[str]) -> list[tuple[Family, Mapping[str, str]]]:
    """Families of programs that the names are of, with their matches: the one with most names first."""
    found = [(family, family.matches(names)) for family in program_families()]
    ordered = sorted((pair for pair in found if pair[1]), key=lambda pair: -len(pair[1]))
    numbered = [family.name for family, _ in ordered if family.name in NUMBERS][1:]
    return [pair for pair in ordered if pair[0].name not in numbered]


def combinations(names: Iterable[str], known: frozenset[str]) -> dict[str, tuple[str, ...]]:
    """Names that consist of the names of two or more shapes, of `known` keys or of the file, with the keys of these.

    A word as "corrective" before one name does, too.
    """
    given = list(names)
    own = {key(name_words(name)) for name in given}
    parts = {part for part in known | own if len(part) >= LEAST_PART} - {"left", "right"}
    found = {name: _parts_of(name, known, parts) for name in given}
    return {name: of for name, of in found.items() if of}


def _parts_of(name: str, known: frozenset[str], parts: set[str]) -> tuple[str, ...]:
    """Keys of the most shapes of whose names a name consists; none where it is the name of one."""
    words = all_words(name)
    # a name of one shape; what stands before a full stop may be another one
    if key(name_words(name)) in known and len(words) == len(name_words(name)):
        return ()
    marked = bool(words) and words[0] in MARKERS
    rest, least = (words[1:], 1) if marked else (words, 2)
    # names of which the first words can consist; None where they cannot
    most: list[tuple[str, ...] | None] = [(), *[None] * len(rest)]
    for end in range(1, len(rest) + 1):
        spans = ((before, rest[first:end]) for first, before in enumerate(most[:end]) if before is not None)
        most[end] = max(
            ((*before, key(span)) for before, span in spans if span != words and _is_part(span, parts)),
            key=len, default=None,
        )  # fmt: skip
    found = most[-1] or ()
    return found if len(found) >= least else ()


def _is_part(span: Words, parts: set[str]) -> bool:
    return key(span) in parts or (span[-1] in ("left", "right") and key(span[:-1]) in parts)


def _read(name: str) -> Family:
    lines = files(FOLDER).joinpath(f"{name}.tsv").read_text("utf-8").splitlines()
    table = csv.DictReader((line for line in lines if not line.startswith("#")), delimiter="\t")
    rows = ((row[HEADER[0]], row[HEADER[1]], float(row[HEADER[2]])) for row in table)
    return Family(name, tuple(chain.from_iterable(_rows(*row) for row in rows)))


def _rows(shape: str, source: str, gain: float) -> list[FamilyRow]:
    alternatives = source.split("|")
    if not shape.endswith("*"):
        added = tuple(_keys(dict.fromkeys(_sided(name, side) for side in range(2))) for name in alternatives)
        return [FamilyRow(shape, added, gain)]
    stem = shape.removesuffix("*")
    return [
        FamilyRow(stem + SIDES[side], tuple(_keys([_sided(name, side)]) for name in alternatives), gain)
        for side in range(2)
    ]


def _sided(source: str, side: int) -> str:
    return _PATTERN.sub(lambda found: found.group(1 + side), source)


def _keys(names: Iterable[str]) -> tuple[str, ...]:
    return tuple(key(name_words(name)) for name in names)
