"""Contents of a marker file, and what its readers share: units, names, and frames at a constant rate."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from corpus_tools.decomposition.marker_clock import place_rows
from tts2face.numeric.arrays import FloatArray
from tts2face.types import Waveform

MM_PER_UNIT = {
    "": 1.0, "mm": 1.0, "millimeters": 1.0, "cm": 10.0, "centimeters": 10.0, "dm": 100.0, "m": 1000.0, "meters": 1000.0,
    "in": 25.4, "inch": 25.4, "inches": 25.4, "ft": 304.8, "feet": 304.8,
}  # fmt: skip
FARTHEST_MM = 1e6  # a coordinate beyond it is how Cortex writes a gap (9999999)
SAID_DIFFERENCE = 1e-4  # of a rate: 59.94 is 59.9401
MAX_FRAMES = 4_000_000  # an hour at 1000 frames a second: beyond it a frame number is damaged


@dataclass(frozen=True, slots=True, eq=False)
class MarkerTake:
    """Contents of a file: `points` (T, M, 3) in mm of the markers `names`, NaN in gaps, and sound where it has some.

    `notes` say what is missing and what is guessed, one sentence each.
    """

    names: tuple[str, ...]
    points: FloatArray
    fps: float
    sound: Waveform | None = None
    notes: tuple[str, ...] = ()


def short_names(labels: Sequence[str]) -> tuple[str, ...]:
    """Names of markers without that of their subject before a colon, unless two would be alike."""
    short = [label.rpartition(":")[2].strip() for label in labels]
    count = Counter(short)
    return tuple(name if count[name] == 1 else label.strip() for name, label in zip(short, labels, strict=True))


def parse_cells(cells: Sequence[str], n_columns: int) -> list[float]:
    """Numbers of the first cells of a row, NaN where there is none; a decimal comma counts as a point."""
    found = []
    for cell in [*cells[:n_columns], *[""] * (n_columns - len(cells))]:
        try:
            found.append(float(cell.replace(",", ".")))
        except ValueError:
            found.append(np.nan)
    return found


def build_take(
    names: Sequence[str], values: FloatArray, mm_per_unit: float, *, stated: float = 0.0, given: float | None = None
) -> MarkerTake:
    """Frames at a constant rate from rows (T, 2 + 3 M) of a frame number, a time in seconds, and places.

    Rows stand where their times say, else their numbers; what neither has is a gap, and rows that do not come after
    those before are left out (ValueError: no rate is there, or there are no frames).

    Parameters
    ----------
    stated, given
        Frame rates that the file states, 0 for none, and that the user gives. Times that are good decide, then the
        user.
    """
    if not len(values):
        raise ValueError("it has no frame")
    notes = list[str]()
    clock = place_rows(values[:, 0], values[:, 1], given or stated, notes)
    if not clock.fps and len(clock.rows) > 1:
        raise ValueError("it states no frame rate")
    n_lost = len(values) - len(clock.rows)
    if n_lost:
        notes.append(f"rows left out, as their frame number and time are missing or no later ones: {n_lost}")
    _compare_rates(clock.fps, stated, given, notes)
    if clock.frames[-1] >= MAX_FRAMES:
        raise ValueError(f"its frames reach number {clock.frames[-1]:g}")
    places = values[clock.rows, 2:].reshape(len(clock.rows), len(names), 3) * mm_per_unit
    # a place of zeros, and one beyond all rooms, are how programs mark a gap
    is_gap = np.isnan(places).any(axis=2) | (places == 0.0).all(axis=2) | (np.abs(places) > FARTHEST_MM).any(axis=2)
    points = np.full((clock.frames[-1] + 1, len(names), 3), np.nan)
    points[clock.frames] = np.where(is_gap[..., None], np.nan, places)
    return MarkerTake(short_names(names), points, clock.fps, notes=tuple(notes))


def _compare_rates(taken: float, stated: float, given: float | None, notes: list[str]) -> None:
    """Notes on rates that are not taken."""
    if stated > 0 and abs(stated - taken) > SAID_DIFFERENCE * taken:
        notes.append(f"it states {stated:g} frames a second; {taken:g} are taken")
    if given and abs(given - taken) > SAID_DIFFERENCE * taken:
        notes.append(f"{given:g} frames a second were given, but its times have {taken:g}, which are taken")
