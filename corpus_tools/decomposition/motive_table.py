"""Reader of the CSV tables that OptiTrack's Motive exports.

Source: OptiTrack's documentation, "Data Export: CSV" (format versions 1.2 to 1.25). A line of names and values about
the take; lines with type, name, ID and kind of each column; a line Frame, Time (Seconds) and axes; then the frames.
Rotations, rigid bodies, bones and errors stand beside the markers.
"""

from pathlib import Path

import numpy as np

from corpus_tools.decomposition.marker_take import MM_PER_UNIT, MarkerTake, build_take, parse_cells
from lexicon.errors import DataError

FIRST_CELL = "format version"
AXES = ("x", "y", "z")
MARKER_TYPES = ("marker", "rigid body marker", "bone marker")  # measured ones first; the others follow a model
OTHER_TYPES = ("rigid body", "bone", "skeleton", "force plate", "device")
POSITION, ROTATION = "position", "rotation"
DEFAULT_UNIT = "meters"


def is_motive_table(rows: list[list[str]]) -> bool:
    """Whether a table begins like one of Motive."""
    return bool(rows) and rows[0][0].strip().lower() == FIRST_CELL


def read_motive(path: Path, rows: list[list[str]], fps: float | None = None) -> MarkerTake:
    """The markers of a table of Motive in mm; empty cells are gaps; `fps` and errors as `read_trc`."""
    try:
        return _parse(rows, fps)
    except ValueError as broken:
        raise DataError(f"{path} is a table of Motive that cannot be read: {broken}") from broken


def _parse(rows: list[list[str]], fps: float | None) -> MarkerTake:
    header = dict(zip((cell.strip().lower() for cell in rows[0][::2]), rows[0][1::2], strict=False))
    unit = header.get("length units", DEFAULT_UNIT).strip().lower()
    if unit not in MM_PER_UNIT:
        raise ValueError(f"its Length Units are {unit!r}; export millimetres, centimetres or metres")
    at = next((number for number, row in enumerate(rows) if row[0].strip().lower() == "frame"), None)
    if at is None:
        raise ValueError("it has no line that begins with Frame; export it with headings")
    columns = _marker_columns(rows[1:at], [cell.strip().lower() for cell in rows[at]])
    order = [0, 1, *(column for places in columns.values() for column in places)]
    n_columns = max(order) + 1
    values = np.array([parse_cells(row, n_columns) for row in rows[at + 1 :]]).reshape(-1, n_columns)[:, order]
    stated = parse_cells([header.get("export frame rate", header.get("capture frame rate", ""))], 1)[0]
    return build_take(list(columns), values, MM_PER_UNIT[unit], stated=max(np.nan_to_num(stated), 0.0), given=fps)


def _marker_columns(headings: list[list[str]], axes: list[str]) -> dict[str, list[int]]:
    """Columns of x, y and z by the names of the markers."""
    lines = [[cell.strip() for cell in row] + [""] * (len(axes) - len(row)) for row in headings]
    types = next((line for line in lines if {cell.lower() for cell in line} & {*MARKER_TYPES, *OTHER_TYPES}), None)
    kinds = next((line for line in lines if {cell.lower() for cell in line} & {POSITION, ROTATION}), None)
    if types is None or kinds is None:
        raise ValueError("it has no headings with the types and kinds of its columns; export it with headings")
    names = lines[lines.index(types) + 1]
    for wanted in MARKER_TYPES:
        found = dict[str, list[int]]()
        for axis in AXES:
            for column in range(2, len(axes)):
                is_place = kinds[column].lower() == POSITION and types[column].lower() == wanted
                if is_place and axes[column] == axis:
                    found.setdefault(names[column], []).append(column)
        if found:
            return _check_axes(found)
    raise ValueError("it has no markers, but rigid bodies or bones; export it with markers")


def _check_axes(columns: dict[str, list[int]]) -> dict[str, list[int]]:
    odd = next((name for name, places in columns.items() if len(places) != len(AXES)), None)
    if odd is not None:
        raise ValueError(f"the marker {odd} has {len(columns[odd])} places in a row, not three")
    return columns
