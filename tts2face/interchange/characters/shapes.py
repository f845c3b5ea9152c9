"""Mapping from the shapes of a face to morph targets and expressions of a character, and its files (TSV, TOML)."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from lexicon.errors import DataError, InputError
from lexicon.values.checks import check_type, format_value
from lexicon.values.files import read_text
from lexicon.values.tables import parse_cell
from lexicon.values.toml_text import parse_toml

MAX_GAIN = 10.0
MAX_MAPPING_BYTES = 1_000_000
NOTHING = "-"  # source of a shape that is left out
TRANSFER = "transfer"  # shapes of a shipped head, in place of the character's own
SIDES = ("Left", "Right")
WHOLE = ("jaw", "mouth")  # what moves as a whole to the left or right
HEADER = ("shape", "source", "gain")


@dataclass(frozen=True, slots=True)
class ShapeSource:
    """Morph target or expression of a character, times a gain; on one side of the face only if `side` names it."""

    name: str
    gain: float = 1.0
    side: str = ""


ShapeMapping = Mapping[str, tuple[ShapeSource, ...]]


def with_sides(mapping: ShapeMapping) -> ShapeMapping:
    """Mapping in which a source of both the left and the right shape moves only that side for each of them."""
    users: dict[str, set[str]] = {}
    for shape, sources in mapping.items():
        for source in sources:
            users.setdefault(source.name, set()).add(shape)

    def sided(shape: str, source: ShapeSource) -> ShapeSource:
        side = next((side for side in SIDES if shape.endswith(side) and shape.removesuffix(side) not in WHOLE), "")
        both = side and users[source.name] & opposites(shape, side)
        return replace(source, side=side if both else "")

    return {shape: tuple(sided(shape, source) for source in sources) for shape, sources in mapping.items()}


def opposites(shape: str, side: str) -> set[str]:
    """The shape of the other side; of one that looks in or out also the one that looks the same way there."""
    other = shape.removesuffix(side) + SIDES[side == SIDES[0]]
    return {other, other.replace("LookIn", "LookOut") if "LookIn" in other else other.replace("LookOut", "LookIn")}


def read_mapping(path: Path) -> ShapeMapping:
    """Mapping of a TSV file (shape, source, gain) or of a TOML file with a table ``[shapes]``."""
    if path.suffix not in (".tsv", ".toml"):
        raise InputError(f"a mapping is a .tsv or .toml file, not {path.name}")
    try:
        text = read_text(path, MAX_MAPPING_BYTES)
    except OSError as refused:
        raise InputError(f"cannot read the mapping {path}: {refused.strerror}; check the path") from refused
    rows = _toml_rows(text, path) if path.suffix == ".toml" else _table_rows(text, path)
    mapping: dict[str, tuple[ShapeSource, ...]] = {}
    for place, shape, source, gain in rows:
        if not shape or not source:
            raise DataError(f"{place}: shape or source is empty; give both, or the source {NOTHING}")
        if not -MAX_GAIN <= gain <= MAX_GAIN:
            raise DataError(f"{place}: the gain {gain:g} is not within {MAX_GAIN:g}; correct it")
        mapping[shape] = (*mapping.get(shape, ()), *(() if source == NOTHING else (ShapeSource(source, gain),)))
    if not mapping:
        raise DataError(f"{path} names no shape; add rows of shape, source and gain")
    return with_sides(mapping)


def mapping_table(mapping: ShapeMapping) -> str:
    """Mapping as the text of a TSV file."""
    rows = [
        "\t".join((shape, source.name, f"{source.gain:g}")) for shape, sources in mapping.items() for source in sources
    ]
    return "\n".join(["\t".join(HEADER), *rows]) + "\n"


def _table_rows(text: str, path: Path) -> list[tuple[str, str, str, float]]:
    rows = []
    for number, line in enumerate(text.splitlines(), 1):
        cells = [cell.strip() for cell in line.split("\t")]
        if not line.strip() or line.startswith("#") or tuple(cells) == HEADER[: len(cells)]:
            continue
        place = f"{path}, line {number}"
        if len(cells) not in (2, 3):
            raise DataError(f"{place}: has {len(cells)} columns; give shape, source and gain, separated by tabs")
        rows.append((place, cells[0], cells[1], parse_cell(cells[2], path, number) if len(cells) == 3 else 1.0))
    return rows


def _toml_rows(text: str, path: Path) -> list[tuple[str, str, str, float]]:
    shapes = parse_toml(text, str(path)).get("shapes")
    if not isinstance(shapes, dict):
        raise DataError(f'{path} has no table [shapes]; add one with lines such as jawOpen = "MouthOpen"')
    rows = []
    for shape, value in shapes.items():
        place = f"{path}, {shape}"
        sources = {value: 1.0} if isinstance(value, str) else value
        if not isinstance(sources, dict):
            raise DataError(f"{place}: give a name or a table of names with gains, not {format_value(value)}")
        try:
            rows += [
                (place, shape, name, check_type(f"the gain of {name}", gain, float)) for name, gain in sources.items()
            ]
        except InputError as wrong:
            raise DataError(f"{place}: {wrong}") from wrong
    return rows
