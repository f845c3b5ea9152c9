"""Reader of .trc files: tables of markers by Cortex, OpenSim and others.

Source: OpenSim's documentation, "Marker (.trc) Files". Three lines of a header, the names of the markers, each above
its first of three columns, a line of axes, then rows of a frame number, a time and places, divided by tabs.
"""

from pathlib import Path

import numpy as np

from corpus_tools.decomposition.marker_take import MM_PER_UNIT, MarkerTake, build_take, parse_cells
from lexicon.errors import DataError
from lexicon.values.files import read_text
from lexicon.values.tables import LARGEST_TABLE_BYTES

FIRST_WORD = "PathFileType"
COMMENTS = ("#", "//")


def read_trc(path: Path, fps: float | None = None) -> MarkerTake:
    """The markers of a .trc file in mm; errors as `read_markers`.

    Empty cells, NaN, zeros and 9999999 are gaps; rows may end before the last marker.

    Parameters
    ----------
    fps
        Frame rate of a file whose times do not show it.
    """
    try:
        return _parse(read_text(path, LARGEST_TABLE_BYTES), fps)
    except OSError as refused:
        raise DataError(f"{path} cannot be read ({refused.strerror}); check the file") from refused
    except ValueError as broken:
        if isinstance(broken, DataError):
            raise
        raise DataError(f"{path} cannot be read as .trc: {broken}") from broken


def _parse(text: str, fps: float | None) -> MarkerTake:
    lines = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith(COMMENTS)]
    at = next((number for number, line in enumerate(lines) if line.lstrip().lower().startswith("frame#")), None)
    if at is None or not lines[0].lstrip().startswith(FIRST_WORD):
        raise ValueError(f"it needs a first line {FIRST_WORD}, and a line Frame#, Time and the names of the markers")
    keys, stated = (_cells(line) for line in (lines[at - 2], lines[at - 1]))
    header = dict(zip((key.strip().lower() for key in keys), (value.strip() for value in stated), strict=False))
    unit = header.get("units", "").lower()
    if unit not in MM_PER_UNIT:
        raise ValueError(f"its unit is {unit!r}; Units must be one of {', '.join(filter(None, MM_PER_UNIT))}")
    names = [cell.strip() for cell in _cells(lines[at])[2:] if cell.strip()]
    if not names:
        raise ValueError("it names no marker")
    n_columns = 2 + 3 * len(names)
    rows = [parse_cells(_cells(line), n_columns) for line in lines[at + 1 :]]
    # the line of axes has no number
    values = np.array([row for row in rows if np.isfinite(row).any()]).reshape(-1, n_columns)
    rate = parse_cells([header.get("datarate", "")], 1)[0]
    return build_take(names, values, MM_PER_UNIT[unit], stated=max(np.nan_to_num(rate), 0.0), given=fps)


def _cells(line: str) -> list[str]:
    # some programs write spaces, between which no empty cell can stand
    return line.split("\t") if "\t" in line else line.split()
