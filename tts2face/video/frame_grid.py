"""Resampling of tracked points to the uniform times i / fps, and interpolation of gaps."""

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from tts2face.interpolation import interpolate_linear

MAX_FILLED_GAP_S = 0.12  # longest gap that is interpolated; lips make no complete movement in less
SAME_INSTANT_S = 0.001  # times in a file are rounded to milliseconds


def resample_to_grid(
    points: NDArray[np.float32], times: NDArray[np.float64], fps: float
) -> tuple[NDArray[np.float32], int]:
    """Points at the times i / fps between the first time and the last, and the first i.

    Parameters
    ----------
    points : (T, ...)
        Values at `times`.
    times : (T,)
        Seconds; they must increase.

    Raises
    ------
    DataError
        Times do not increase.
    """
    if (np.diff(times) <= 0).any():
        raise DataError("the times of the frames do not increase; convert the recording with ffmpeg")
    first = int(np.ceil((times[0] - SAME_INSTANT_S) * fps))
    last = int(np.floor((times[-1] + SAME_INSTANT_S) * fps))
    instants = np.arange(first, last + 1) / fps
    if len(instants) == len(times) and np.abs(instants - times).max() <= SAME_INSTANT_S:
        return points, first
    return interpolate_linear(points, times, instants), first


def face_span(points: NDArray[np.float32]) -> tuple[int, int]:
    """Half-open range from the first frame with a face to the last, of (T, L, 3) points that are NaN without one."""
    present = np.flatnonzero(~np.isnan(points[:, 0, 0]))
    return int(present[0]), int(present[-1]) + 1


def fill_gaps(points: NDArray[np.float32], fps: float) -> tuple[NDArray[np.float32], int]:
    """Fill short gaps of NaN by linear interpolation; returns the points and the number of frames filled.

    Raises
    ------
    DataError
        A gap is longer than `MAX_FILLED_GAP_S`.
    """
    missing = np.isnan(points[:, 0, 0])
    if not missing.any():
        return points, 0
    present = np.flatnonzero(~missing)
    longest = int(np.diff(present).max()) - 1
    if longest > round(MAX_FILLED_GAP_S * fps):
        raise DataError(f"no face is visible for {longest / fps:.2f} s")
    grid, _ = resample_to_grid(points[present], present / fps, fps)
    return grid, int(missing.sum())
