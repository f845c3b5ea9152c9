"""Reader of Live Link Face captures and other tables of ARKit weights: CSV files with a time and channels in each row.

A take cannot be made again: what can be read of it is read, and notes say what is missing or guessed.
"""

import csv
from collections import Counter
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from lexicon.errors import DataError, InputError
from lexicon.values.tables import parse_table, read_table
from tts2face.numeric.arrays import FloatArray, IntArray, Mask, interpolate_columns
from tts2face.types import HEAD_CHANNELS, Trajectory
from tts2face.video.blendshapes import BLENDSHAPES
from tts2face.video.capture_clock import GAP_STEPS, MAX_SHORT_GAP_S, CaptureTimes, order_frames
from tts2face.video.capture_values import describe_damage, read_turns, read_weights
from tts2face.video.timecode import DEFAULT_TIMECODE_RATE, TIME_COLUMNS, parse_times

HEAD_COLUMNS = ("headpitch", "headyaw", "headroll")
NO_SHAPES = ("blendshapecount", "head", "lefteye", "righteye")  # how other columns begin
ARKIT_NAMES = {name.lower(): name for name in (*BLENDSHAPES[1:], "tongueOut")}
DELIMITERS = ",;\t"
TABLE_SUFFIXES = frozenset({".csv", ".tsv", ".txt"})  # of tables: spreadsheets write tabs into .txt
MIN_CAPTURE_FPS, MAX_CAPTURE_FPS = 10.0, 240.0
RELAX_S = 0.25  # from a pose to the take's usual one in a long gap, and back
MAX_QUOTED = 4  # gaps quoted in a note
MAX_HEADER_ROW, MAX_HEADER_BYTES = 20, 1 << 16  # of what stands above the first frame
USUAL_SHARE = 0.02  # of rows with another number of cells than the heading: fewer are damaged
MAX_UNNAMED_SHARE = 0.25  # cells beyond the heading, over its columns: more are no further columns
HEAD_SIGNS = np.array([1.0, -1.0, 1.0])  # as of its eyes: pitch down (EyePitch follows EyeLookDown), yaw to the right


@dataclass(frozen=True, slots=True, eq=False)
class FaceCapture:
    """Weights (T, 52) by ARKit name and head pose (T, 6) with zero translation, at a uniform frame rate.

    `notes` say what is missing in the file and what is guessed about it, one sentence each; `gaps` are the times in
    seconds in which there is no face, from and to.
    """

    weights: Trajectory
    head: Trajectory
    notes: tuple[str, ...] = ()
    gaps: tuple[tuple[float, float], ...] = ()


def read_livelink(path: Path, fps: float | None = None) -> FaceCapture:
    """Read a Live Link Face file.

    Parameters
    ----------
    fps
        Frames that its numbers or timecodes count to a second, where it does not show that itself.

    Raises
    ------
    InputError
        The file does not exist.
    DataError
        The file has another format or is too large, or holds fewer than two frames.
    """
    if not path.is_file():
        raise InputError(f"there is no capture {path}; check the path")
    rows = read_table(path, delimiters=DELIMITERS, is_heading=_is_heading)
    first = _header_row(rows)
    if first is None:
        raise DataError(
            f"{path} is not a CSV file of Live Link Face: it needs the columns Timecode, JawOpen, ... ; "
            "it has no row with a column of times and ARKit's names"
        )
    names = _column_names(rows[first])
    labels, values, notes = _parse_rows(names, rows[first + 1 :])
    column = _time_column(names)
    clock = order_frames(parse_times(labels, fps, names[column]), fps or DEFAULT_TIMECODE_RATE)
    if len(clock.rows) < 2:
        reasons = "".join(f"; {note}" for note in (*clock.notes, *notes))
        raise DataError(f"{path} holds fewer than two frames with a time and a face ({len(clock.rows)}){reasons}")
    if not MIN_CAPTURE_FPS <= clock.fps <= MAX_CAPTURE_FPS:
        raise DataError(
            f"{path} has {clock.fps:g} frames per second by its column {rows[first][column].strip()}; "
            f"supported are {MIN_CAPTURE_FPS:g} to {MAX_CAPTURE_FPS:g}"
        )
    return _build_capture(rows[first], names, values[clock.rows], clock, notes)


def is_capture_table(path: Path) -> bool:
    """Whether a file is a table of ARKit weights, by the names of its columns."""
    if not path.is_file():
        return False
    with path.open("rb") as file:
        start = file.read(MAX_HEADER_BYTES).decode("utf-8-sig", errors="replace")
    try:
        return _header_row(parse_table(start, DELIMITERS, _is_heading)) is not None
    except csv.Error:
        return False


def _normal(cell: str) -> str:
    """Name of a column in lower case, without marks between words; sides as ARKit writes them."""
    name = "".join(letter for letter in cell.lower() if letter.isalnum())
    for short, side in (("l", "left"), ("r", "right")):
        # iFacialMocap and Face Cap write _L and _R
        if name.endswith(short) and name[:-1] + side in ARKIT_NAMES:
            return name[:-1] + side
    return name


def _header_row(rows: list[list[str]]) -> int | None:
    """Number of the row with the names of the columns; None without one."""
    return next((number for number, row in enumerate(rows[:MAX_HEADER_ROW]) if _is_heading(row)), None)


def _is_heading(row: list[str]) -> bool:
    names = {_normal(cell) for cell in row}
    return bool(names & TIME_COLUMNS.keys() and names & ARKIT_NAMES.keys())


def _column_names(heading: list[str]) -> list[str]:
    """Names of the columns, without empty ones at the end, which a comma there makes."""
    names = [_normal(cell) for cell in heading]
    return names[: max(column for column, name in enumerate(names) if name) + 1]


def _time_column(names: list[str]) -> int:
    return names.index(next(name for name in TIME_COLUMNS if name in names))


def _parse_rows(names: list[str], rows: list[list[str]]) -> tuple[list[str], FloatArray, list[str]]:
    """Times as written and values (T, C) of all columns, NaN where a cell holds no number; of rows with a face."""
    at, shapes = _time_column(names), [column for column, name in enumerate(names) if name in ARKIT_NAMES]
    labels, values = list[str](), list[list[float]]()
    n_cut = n_empty = 0
    lengths = _usual_lengths(rows, len(names))
    for row in rows:
        cells = row[: len(names)]
        # an empty line of a spreadsheet; a heading that is repeated
        if not any(cell.strip() for cell in row) or [_normal(cell) for cell in cells[:3]] == names[:3]:
            continue
        # a row of a time and a count alone has no face
        if len(row) > 2 and _filled_length(row, len(names)) not in lengths:
            n_cut += 1
            continue
        cells += [""] * (len(names) - len(cells))
        label = cells[at]
        cells[at] = "nan"  # mostly it is no number: so all others are parsed at once
        numbers = _parse_numbers(cells)
        if np.isnan([numbers[column] for column in shapes]).all():
            n_empty += 1
            continue
        labels.append(label)
        values.append(numbers)
    notes = []
    if n_cut:
        notes.append(f"rows left out, as they have more or fewer cells than columns: {n_cut}")
    if n_empty:
        notes.append(f"rows without a face: {n_empty}")
    return labels, np.array(values).reshape(len(values), len(names)), notes


def _filled_length(row: list[str], n_columns: int) -> int:
    """Number of cells of a row, without empty ones beyond the columns."""
    length = len(row)
    while length > n_columns and not row[length - 1].strip():
        length -= 1
    return length


def _usual_lengths(rows: list[list[str]], n_columns: int) -> set[int]:
    """Numbers of cells that whole rows have: programs leave out empty cells at the end, or names of last columns."""
    counts = Counter(_filled_length(row, n_columns) for row in rows)
    least, most = max(2, USUAL_SHARE * len(rows)), (1 + MAX_UNNAMED_SHARE) * n_columns
    return {n_columns, *(length for length, count in counts.items() if count >= least and length <= most)}


def _parse_numbers(cells: list[str]) -> list[float]:
    try:
        return [float(cell) for cell in cells]
    except ValueError:
        return [_number(cell) for cell in cells]


def _number(cell: str) -> float:
    try:
        value = float(cell.replace(",", "."))
    except ValueError:
        return np.nan
    return value if np.isfinite(value) else np.nan


def _build_capture(
    heading: list[str], names: list[str], values: FloatArray, clock: CaptureTimes, notes: list[str]
) -> FaceCapture:
    """The capture at even times."""
    shapes, head = _channel_columns(names), [names.index(name) for name in HEAD_COLUMNS if name in names]
    head = head if len(head) == len(HEAD_COLUMNS) else []
    written = np.where(np.isfinite(values), values, np.nan)
    read = _read_cells(names, written, shapes, head, notes)
    notes += describe_damage(written, read, [cell.strip() for cell in heading], clock.times)
    has_value: Mask = np.asarray(np.isfinite(read).any(axis=0))
    shapes = [column for column in shapes if has_value[column]]
    columns: IntArray = np.array([*shapes, *(head if has_value[head].all() else ())])
    whole = _fill_cells(read[:, columns], clock.times)
    if n_cells := int(np.isnan(written[:, columns]).sum()):
        notes.append(f"cells without a number, which are interpolated: {n_cells}")
    # a turn may leap from half a circle to minus half
    whole[:, len(shapes) :] = np.unwrap(whole[:, len(shapes) :], axis=0)
    n_frames = int(np.floor(clock.times[-1] * clock.fps + 0.5)) + 1
    even = np.arange(n_frames) / clock.fps
    moved = interpolate_columns(*_relax_in_gaps(whole, clock, notes), even)
    pose = np.zeros((n_frames, len(HEAD_CHANNELS)))
    if len(columns) > len(shapes):
        turns = moved[:, len(shapes) :]
        # angles from the median: the telephone need not stand straight before the face
        pose[:, :3] = HEAD_SIGNS * (turns - np.median(turns, axis=0))
    channels = tuple(_channel_name(heading[column], names[column]) for column in shapes)
    return FaceCapture(
        Trajectory(channels, moved[:, : len(shapes)], clock.fps),
        Trajectory(HEAD_CHANNELS, pose, clock.fps),
        (*clock.notes, *notes),
        _long_gaps(clock.times),
    )


def _read_cells(
    names: list[str], written: FloatArray, shapes: list[int], head: list[int], notes: list[str]
) -> FloatArray:
    """Cells (T, C) as weights and radians, NaN where one is damaged; of other columns as they are."""
    has_value: Mask = np.asarray(np.isfinite(written).any(axis=0))
    read = written.copy()
    shapes = [column for column in shapes if has_value[column]]
    read[:, shapes] = read_weights(read[:, shapes], np.array([names[at] in ARKIT_NAMES for at in shapes]), notes)
    if head and has_value[head].all():
        read[:, head] = read_turns(read[:, head], notes)
    return read


def _channel_columns(names: list[str]) -> list[int]:
    """Columns of shapes, the first of each name: ARKit's, and those of a character's own."""
    found = dict[str, int]()
    for column, name in enumerate(names):
        if name and name not in TIME_COLUMNS and not name.startswith(NO_SHAPES):
            found.setdefault(name, column)
    return list(found.values())


def _channel_name(written: str, name: str) -> str:
    own = written.strip()
    return ARKIT_NAMES.get(name, own[:1].lower() + own[1:])


def _fill_cells(values: FloatArray, times: FloatArray) -> FloatArray:
    """Values (T, C) without NaN, by linear interpolation in each column."""
    is_empty, whole = np.isnan(values), values.copy()
    for column in np.flatnonzero(is_empty.any(axis=0)):
        there = ~is_empty[:, column]
        whole[:, column] = np.interp(times, times[there], values[there, column])
    return whole


def _long_gaps(times: FloatArray) -> tuple[tuple[float, float], ...]:
    """Times from and to which there is no face for too long to be interpolated."""
    return tuple((a, b) for a, b in pairwise(times.tolist()) if b - a > MAX_SHORT_GAP_S)


def _relax_in_gaps(values: FloatArray, clock: CaptureTimes, notes: list[str]) -> tuple[FloatArray, FloatArray]:
    """Values and times with the take's median pose in gaps that are too long to be interpolated; notes on all gaps."""
    steps = np.diff(clock.times)
    gaps = _long_gaps(clock.times)
    is_long = steps > MAX_SHORT_GAP_S
    is_short = (steps > GAP_STEPS / clock.fps) & ~is_long
    if is_short.any():
        n_lost = int(np.rint(steps[is_short] * clock.fps - 1).sum())
        at = clock.times[:-1][is_short]
        notes.append(f"frames missing from {at[0]:.2f} s on, which are interpolated: {n_lost}")
    if not gaps:
        return values, clock.times
    starts, ends = np.array(gaps).T
    quoted = ", ".join(f"{a:.2f} to {b:.2f} s" for a, b in gaps[:MAX_QUOTED])
    more = f" and {len(starts) - MAX_QUOTED} more" if len(starts) > MAX_QUOTED else ""
    notes.append(f"there is no face from {quoted}{more}; the pose relaxes there to the take's usual one")
    added = np.concatenate([starts + RELAX_S, ends - RELAX_S])
    times = np.concatenate([clock.times, added])
    order = np.argsort(times, kind="stable")
    usual = np.repeat(np.median(values, axis=0)[None], len(added), axis=0)
    return np.concatenate([values, usual])[order], times[order]
