"""Pictures read at places between their pixels, and motion at instants between its frames."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.compilation import kernel

Array = NDArray[Any]


@kernel
def interpolate_bilinear(picture: Array, x: float, y: float, c: int) -> float:
    """One channel of an (H, W, C) picture at a place; beyond its edge the edge goes on."""
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
    """Write into (P, C) `out` an (H, W, C) picture at P places inside triangles of (N, 2) points.

    Place i is the sum of ``weights[i, k] * points[corners[i, k]]``, k = 0..2: piecewise-affine warping.
    """
    for i in range(len(corners)):
        x = y = 0.0
        for k in range(3):
            x += weights[i, k] * points[corners[i, k], 0]
            y += weights[i, k] * points[corners[i, k], 1]
        for c in range(out.shape[1]):
            out[i, c] = interpolate_bilinear(picture, x, y, c)


def interpolate_cubic(values: NDArray[np.float32], at: NDArray[np.float64]) -> NDArray[np.float32]:
    """(N, D) of (T, D) values at rows between them, by cubics through them (Catmull and Rom 1974)."""
    low = np.minimum(at, len(values) - 1).astype(int)
    part = (at - low)[:, None].astype(np.float32)
    before, here, after, beyond = (values[np.clip(low + k, 0, len(values) - 1)] for k in (-1, 0, 1, 2))
    slope_here, slope_after = (after - before) / 2, (beyond - here) / 2
    bend, twist = 3 * (after - here) - 2 * slope_here - slope_after, 2 * (here - after) + slope_here + slope_after
    return np.asarray(here + part * (slope_here + part * (bend + part * twist)), np.float32)
