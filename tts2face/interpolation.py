"""Interpolation of pictures (bilinear) and of trajectories (linear, cubic)."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.compilation import kernel

Array = NDArray[Any]


@kernel
def interpolate_bilinear(picture: Array, x: float, y: float, c: int) -> float:
    """Value of channel `c` of an (H, W, C) picture at (x, y) in pixels; positions outside are clamped to the edge."""
    height, width = picture.shape[0], picture.shape[1]
    x = min(max(x, 0.0), width - 1.0)
    y = min(max(y, 0.0), height - 1.0)
    left, top = int(x), int(y)
    right, below = min(left + 1, width - 1), min(top + 1, height - 1)
    across, along = x - left, y - top
    upper = picture[top, left, c] * (1.0 - across) + picture[top, right, c] * across
    lower = picture[below, left, c] * (1.0 - across) + picture[below, right, c] * across
    return float(upper * (1.0 - along) + lower * along)


@kernel
def sample_triangles(picture: Array, points: Array, corners: Array, weights: Array, out: Array) -> None:
    """Sample an (H, W, C) picture at P positions inside triangles of (N, 2) points, into (P, C) `out`.

    Position i is the sum of ``weights[i, k] * points[corners[i, k]]``, k = 0..2 (piecewise-affine warping).
    """
    for i in range(len(corners)):
        x = y = 0.0
        for k in range(3):
            x += weights[i, k] * points[corners[i, k], 0]
            y += weights[i, k] * points[corners[i, k], 1]
        for c in range(out.shape[1]):
            out[i, c] = interpolate_bilinear(picture, x, y, c)


def interpolate_cubic(values: NDArray[np.float32], at: NDArray[np.float64]) -> NDArray[np.float32]:
    """(N, D) values at N fractional row indices of (T, D) values, by Catmull-Rom cubics (Catmull and Rom 1974)."""
    low = np.minimum(at, len(values) - 1).astype(int)
    part = (at - low)[:, None].astype(np.float32)
    before, here, after, beyond = (values[np.clip(low + k, 0, len(values) - 1)] for k in (-1, 0, 1, 2))
    slope_here, slope_after = (after - before) / 2, (beyond - here) / 2
    bend, twist = 3 * (after - here) - 2 * slope_here - slope_after, 2 * (here - after) + slope_here + slope_after
    return np.asarray(here + part * (slope_here + part * (bend + part * twist)), np.float32)


def interpolate_linear(
    values: NDArray[np.float32], times: NDArray[np.float64], at: NDArray[np.float64]
) -> NDArray[np.float32]:
    """Values (N, ...) at N instants from (T, ...) at increasing times (T,); constant before and after."""
    if len(times) == 1:
        return np.repeat(values, len(at), axis=0)
    after = np.clip(np.searchsorted(times, at), 1, len(times) - 1)
    share = np.clip((at - times[after - 1]) / (times[after] - times[after - 1]), 0.0, 1.0)
    share = share.reshape(-1, *[1] * (values.ndim - 1)).astype(np.float32)
    return np.asarray(values[after - 1] * (1 - share) + values[after] * share, np.float32)


def interpolate_columns(values: NDArray[np.floating], times: Array, at: Array) -> NDArray[np.float64]:
    """(N, D) values at N instants from (T, D) at increasing times (T,), as float64; constant before and after."""
    return np.stack([np.interp(at, times, column) for column in values.T], axis=1)
