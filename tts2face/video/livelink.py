"""Reader of Live Link Face captures: CSV files with 61 ARKit channels for each frame."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError, InputError
from lexicon.values.tables import read_table
from tts2face.numeric.arrays import interpolate_columns
from tts2face.types import HEAD_CHANNELS, Trajectory

HEAD_COLUMNS = ("HeadPitch", "HeadYaw", "HeadRoll")
MIN_CAPTURE_FPS, MAX_CAPTURE_FPS = 10.0, 240.0
MAX_CAPTURE_GAP_S = 0.5
TIMECODE_RATES = (24, 25, 30, 50, 60, 120)  # frames in a second of timecode
HEAD_SIGNS = np.array([1.0, -1.0, 1.0])  # as of its eyes: pitch down (EyePitch follows EyeLookDown), yaw to the right


@dataclass(frozen=True, slots=True, eq=False)
class FaceCapture:
    """Weights (T, 52) by ARKit name and head pose (T, 6) with zero translation, at a uniform frame rate."""

    weights: Trajectory
    head: Trajectory


def read_livelink(path: Path) -> FaceCapture:
    """Read a Live Link Face file.

    Raises
    ------
    InputError
        The file does not exist.
    DataError
        The file has another format or is too large, or a row is damaged.
    """
    if not path.is_file():
        raise InputError(f"there is no capture {path}; check the path")
    rows = read_table(path)
    if not rows or rows[0][:1] != ["Timecode"] or "JawOpen" not in rows[0] or len(rows) < 3:
        raise DataError(f"{path} is not a CSV file of Live Link Face: it needs the columns Timecode, JawOpen, ...")
    names, times, values = _parse_rows(path, rows)
    fps = _frame_rate(path, times)
    n_frames = int(np.floor((times[-1] - times[0]) * fps + 0.5)) + 1
    even = times[0] + np.arange(n_frames) / fps
    read = interpolate_columns(values, times, even)
    shapes = [at for at, name in enumerate(names) if not name.startswith(("Head", "LeftEye", "RightEye"))]
    channels = tuple(names[at][0].lower() + names[at][1:] for at in shapes)
    head = np.zeros((n_frames, len(HEAD_CHANNELS)))
    if all(name in names for name in HEAD_COLUMNS):
        turns = read[:, [names.index(name) for name in HEAD_COLUMNS]]
        # angles from the median: the telephone need not stand straight before the face
        head[:, :3] = HEAD_SIGNS * (turns - np.median(turns, axis=0))
    return FaceCapture(Trajectory(channels, read[:, shapes], fps), Trajectory(HEAD_CHANNELS, head, fps))


def _parse_rows(path: Path, rows: list[list[str]]) -> tuple[list[str], NDArray[np.float64], NDArray[np.float64]]:
    names = rows[0][2:]
    times, values = [], []
    for number, row in enumerate(rows[1:], start=2):
        if len(row) != len(rows[0]):
            raise DataError(f"line {number} of {path} has {len(row)} columns, not {len(rows[0])}; export it again")
        try:
            times.append(_parse_timecode(row[0]))
            values.append([float(cell) for cell in row[2:]])
        except ValueError as broken:
            raise DataError(f"line {number} of {path} cannot be read ({broken}); export it again") from broken
    if not np.isfinite(values).all():
        raise DataError(f"{path} contains NaN or infinity; export it again")
    seconds, frames = np.array(times).T
    counted = next((rate for rate in TIMECODE_RATES if rate > frames.max()), TIMECODE_RATES[-1])
    return names, seconds + frames / counted, np.array(values)


def _parse_timecode(text: str) -> tuple[float, float]:
    """Seconds and frames of ``hours:minutes:seconds:frames``."""
    hours, minutes, seconds, frames = text.split(":")
    return int(hours) * 3600.0 + int(minutes) * 60.0 + float(seconds), float(frames)


def _frame_rate(path: Path, times: NDArray[np.float64]) -> float:
    steps = np.diff(times)
    if (steps <= 0).any() or steps.max() > MAX_CAPTURE_GAP_S:
        raise DataError(
            f"the times of {path} must increase by at most {MAX_CAPTURE_GAP_S:g} s from row to row; export it again"
        )
    fps = float(np.round(1.0 / np.mean(steps)))
    if not MIN_CAPTURE_FPS <= fps <= MAX_CAPTURE_FPS:
        raise DataError(
            f"{path} has {fps:g} frames per second, not {MIN_CAPTURE_FPS:g} to {MAX_CAPTURE_FPS:g}; export it again"
        )
    return fps
