"""Contents of a marker file, and what its readers share: units, names, and frames at a constant rate."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tts2face.numeric.arrays import FloatArray, IntArray
from tts2face.types import Waveform

MM_PER_UNIT = {
    "": 1.0, "mm": 1.0, "millimeters": 1.0, "cm": 10.0, "centimeters": 10.0, "dm": 100.0, "m": 1000.0, "meters": 1000.0,
    "in": 25.4, "inch": 25.4, "inches": 25.4, "ft": 304.8, "feet": 304.8,
}  # fmt: skip
FARTHEST_MM = 1e6  # a coordinate beyond it is how Cortex writes a gap (9999999)
RATE_TOLERANCE = 0.02  # of a rate: two that are further apart contradict each other
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


def build_take(names: Sequence[str], values: FloatArray, stated_fps: float, mm_per_unit: float) -> MarkerTake:
    """Frames at a constant rate from rows (T, 2 + 3 M) of a frame number, a time in seconds, and places.

    Rows that do not come after all before them are left out; missing frame numbers are gaps. The rate is the stated
    one unless the times contradict it (ValueError: neither is there, or there are no frames).
    """
    notes = list[str]()
    numbers = values[:, 0]
    if not np.isfinite(numbers).any():
        numbers = np.arange(len(values), dtype=np.float64)
    highest = np.fmax.accumulate(np.concatenate([[-np.inf], numbers]))[:-1]
    is_later = np.isfinite(numbers) & (numbers > highest)
    if not is_later.all():
        notes.append(f"rows left out, as their frame number is missing or not a later one: {(~is_later).sum()}")
    numbers, values = numbers[is_later], values[is_later]
    if not len(values):
        raise ValueError("it has no frame")
    rows = np.rint(numbers - numbers[0]).astype(int)
    if rows[-1] >= MAX_FRAMES:
        raise ValueError(f"its frame numbers reach {numbers[-1]:g}")
    fps = _frame_rate(rows, values[:, 1], stated_fps, notes)
    places = values[:, 2:].reshape(len(values), len(names), 3) * mm_per_unit
    # a place of zeros, and one beyond all rooms, are how programs mark a gap
    is_gap = np.isnan(places).any(axis=2) | (places == 0.0).all(axis=2) | (np.abs(places) > FARTHEST_MM).any(axis=2)
    points = np.full((rows[-1] + 1, len(names), 3), np.nan)
    points[rows] = np.where(is_gap[..., None], np.nan, places)
    return MarkerTake(short_names(names), points, fps, notes=tuple(notes))


def _frame_rate(rows: IntArray, times: FloatArray, stated: float, notes: list[str]) -> float:
    there = np.flatnonzero(np.isfinite(times))
    seconds = times[there[-1]] - times[there[0]] if len(there) > 1 else 0.0
    timed = float((rows[there[-1]] - rows[there[0]]) / seconds) if seconds > 0 else 0.0
    if not stated > 0 and not timed:
        raise ValueError("it states no frame rate")
    if not stated > 0:
        return round(timed, 2)
    if timed and abs(timed - stated) > RATE_TOLERANCE * timed:
        notes.append(f"it states {stated:g} frames a second, but its times have {timed:.2f}, which are taken")
        return round(timed, 2)
    return stated
