"""Resampling of tracked points to the uniform times i / fps, and interpolation of gaps."""

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from tts2face.numeric.arrays import interpolate_linear

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
    # two frames at one instant have no order, and no rate
    if (np.diff(times) <= 0).any():
        raise DataError("the times of the frames do not increase; convert the recording with ffmpeg")
    first = int(np.ceil((times[0] - SAME_INSTANT_S) * fps))
    last = int(np.floor((times[-1] + SAME_INSTANT_S) * fps))
    instants = np.arange(first, last + 1) / fps
    if len(instants) == len(times) and np.abs(instants - times).max() <= SAME_INSTANT_S:
        return points, first
    return interpolate_linear(points, times, instants), first


def trim_and_fill(points: NDArray[np.float32], fps: float) -> tuple[NDArray[np.float32], int, int]:
    """Points (T, L, 3) from the first frame with a face to the last, gaps filled; that first frame; frames filled.

    Raises
    ------
    DataError
        No frame shows a face; or as `fill_gaps`.
    """
    present = np.flatnonzero(~np.isnan(points[:, 0, 0]))
    if not len(present):
        raise DataError("no frame shows a face")
    start = int(present[0])
    filled, n_filled = fill_gaps(points[start : int(present[-1]) + 1], fps)
    return filled, start, n_filled


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
