"""Files of facial marker capture: C3D (Vicon, OptiTrack, ...), .trc, tables of Motive and of this project.

The next format is a module with a reader that gives a `MarkerTake`, and its line in `read_markers`.
"""

from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np

from corpus_tools.decomposition.c3d_file import C3dFile, read_c3d_file
from corpus_tools.decomposition.marker_take import MM_PER_UNIT, MarkerTake, build_take, parse_cells
from corpus_tools.decomposition.motive_table import is_motive_table, read_motive
from corpus_tools.decomposition.trc_file import read_trc
from corpus_tools.recordings.sound import SOUND_RATE
from lexicon.errors import DataError, InputError
from lexicon.values.tables import MAX_HEADING_LINES, read_table
from tts2face.models.palette import GESTURE_FPS
from tts2face.types import Waveform

SOUND_LABELS = ("audio", "sound", "voice", "speech", "mic")  # how analogue channels that hold sound are named
MIN_SOUND_HZ = 8000.0  # analogue channels with a lower rate are not sound
MIN_FPS, MAX_FPS = 10.0, 1000.0
AXES = ("x", "y", "z")
FIRST_COLUMNS = ("time", "frame")  # of this project's tables


def read_markers(path: Path, fps: float | None = None) -> MarkerTake:
    """The markers in a ``.c3d``, ``.trc`` or ``.csv`` file.

    Parameters
    ----------
    fps
        Frame rate of a table whose times do not show it.
    """
    readers = {
        ".c3d": lambda: read_c3d(path),
        ".trc": lambda: read_trc(path, fps),
        ".csv": lambda: read_marker_table(path, fps),
    }
    if path.suffix.lower() not in readers:
        raise InputError(f"{path.name} is not a marker file; supported suffixes are .c3d, .trc and .csv")
    if not path.is_file():
        raise InputError(f"there is no capture {path}; check the path")
    take = readers[path.suffix.lower()]()
    if not len(take.points) or not np.isfinite(take.points).any():
        raise DataError(f"{path} holds no marker in any frame; export it again")
    twice = [name for name, count in Counter(take.names).items() if count > 1]
    if twice:
        raise DataError(f"{path} holds the marker {twice[0]} twice; export one person alone")
    if not MIN_FPS <= take.fps <= MAX_FPS:
        raise DataError(f"{path} has {take.fps:g} frames per second; supported rates are {MIN_FPS:g} to {MAX_FPS:g}")
    return take


def read_c3d(path: Path) -> MarkerTake:
    """The markers of a C3D file in mm, without the subject's name before a colon; errors as `read_markers`."""
    try:
        file = read_c3d_file(path)
        fps = file.number("POINT:RATE")
        sound = _analogue_sound(file)
    except (OSError, ValueError, KeyError, IndexError) as broken:
        raise DataError(f"{path} is damaged, or no C3D file ({broken}); export it again") from broken
    units = "".join(file.parameters.get("POINT:UNITS", [])[:1]).lower()
    if units not in MM_PER_UNIT:
        raise DataError(
            f"{path} gives its markers in {units!r}; POINT:UNITS must be {', '.join(filter(None, MM_PER_UNIT))}"
        )
    names = [label.rpartition(":")[2].strip() for label in file.labels("POINT")][: file.points.shape[1]]
    points = file.points[:, : len(names)] * MM_PER_UNIT[units]
    points[(points == 0.0).all(axis=2)] = np.nan  # how old files mark a gap
    lost = f"the file breaks off: of {len(points) + file.n_lost} frames it has {len(points)}"
    return MarkerTake(tuple(names), points, fps, sound, (lost,) if file.n_lost else ())


def _analogue_sound(file: C3dFile) -> Waveform | None:
    """Sound among the analogue channels, without its mean and scaled to full scale."""
    import soxr

    labels = file.labels("ANALOG")
    named = [at for at, label in enumerate(labels) if any(word in label.lower() for word in SOUND_LABELS)]
    # force plates and muscles are analogue channels, too
    if not named or file.number("ANALOG:RATE") < MIN_SOUND_HZ:
        return None
    samples = file.channels[:, named[0]]
    samples = np.nan_to_num(samples - np.nanmean(samples))
    samples_at_rate = soxr.resample(samples.astype(np.float32), file.number("ANALOG:RATE"), SOUND_RATE)
    # to its peak: scales and offsets of channels cancel (decision 198)
    return Waveform(samples_at_rate / max(float(np.abs(samples_at_rate).max(initial=0.0)), 1e-9), SOUND_RATE)


def read_marker_table(path: Path, fps: float | None = None) -> MarkerTake:
    """The markers of a CSV table, that of Motive or one of this project; errors as `read_markers`.

    The first column of the latter is ``time`` in seconds or ``frame``, the others are ``NAME_x``, ``NAME_y``,
    ``NAME_z`` in mm, in any order; empty cells are gaps.
    """
    table = read_table(path, delimiters=",;\t", is_heading=_is_heading)
    first_row = next((number for number, row in enumerate(table[:MAX_HEADING_LINES]) if _is_heading(row)), 0)
    rows = [[cell.strip() for cell in row] for row in table[first_row:]]
    while rows and len(rows[0]) > 1 and not rows[0][-1]:  # a comma at the end of the heading
        del rows[0][-1]
    if is_motive_table(rows):
        return read_motive(path, rows, fps)
    first = rows[0][0].lower() if rows else ""
    if first not in FIRST_COLUMNS or len(rows) < 2:
        raise DataError(
            f"{path} is not a CSV table of markers: it needs the columns time or frame, then NAME_x, ...; "
            "or the headings of Motive, Format Version, ..."
        )
    names = _parse_header(path, rows[0])
    if first == "frame" and fps is None and len(rows) > 2:
        # whose rate no file can say
        raise InputError(f"{path.name} has frame numbers; give its frame rate, or a column time")
    columns = [rows[0].index(f"{name}_{axis}") for name in names for axis in AXES]
    cells = np.array([parse_cells(row, len(rows[0])) for row in rows[1:]])
    values = np.full((len(cells), 2 + len(columns)), np.nan)
    values[:, 0 if first == "frame" else 1] = cells[:, 0]
    values[:, 2:] = cells[:, columns]
    try:
        take = build_take(names, values, 1.0, given=fps)
    except ValueError as broken:
        raise DataError(f"{path} cannot be read: {broken}; check its column {first}") from broken
    n_odd = sum(_is_odd(row, len(rows[0])) for row in rows[1:])
    notes = (f"rows with cells that are no number or beyond the columns, which are left out: {n_odd}",) if n_odd else ()
    return replace(take, notes=(*take.notes, *notes), fps=take.fps or GESTURE_FPS)  # of a still without a rate


def _is_heading(row: list[str]) -> bool:
    if not row:
        return False
    has_places = any(cell.strip().endswith(f"_{AXES[0]}") for cell in row)
    return is_motive_table([row]) or (row[0].strip().lower() in FIRST_COLUMNS and has_places)


def _parse_header(path: Path, header: list[str]) -> tuple[str, ...]:
    names = tuple(dict.fromkeys(column.rpartition("_")[0] for column in header[1:]))
    wanted = sorted(f"{name}_{axis}" for name in names for axis in AXES)
    if sorted(header[1:]) != wanted:
        odd = next(iter(set(header[1:]) ^ set(wanted)), "one twice")
        raise DataError(f"{path} needs the columns NAME_x, NAME_y and NAME_z once for every marker; check {odd}")
    return names


def _is_odd(row: list[str], n_columns: int) -> bool:
    filled = [cell for cell in row[:n_columns] if cell]
    return any(row[n_columns:]) or bool(np.isnan(parse_cells(filled, len(filled))).any())
