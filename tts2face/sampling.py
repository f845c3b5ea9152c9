"""Pictures read at places between their pixels."""

from typing import Any

from numba import njit
from numpy.typing import NDArray

Array = NDArray[Any]


@njit(cache=True, nogil=True, error_model="numpy")
def bilinear(picture: Array, x: float, y: float, c: int) -> float:
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


@njit(cache=True, nogil=True, error_model="numpy")
def sampled(picture: Array, points: Array, corners: Array, weights: Array, out: Array) -> None:
    """Write into (P, C) `out` an (H, W, C) picture at P places inside triangles of (N, 2) points.

    Place i is the sum of ``weights[i, k] * points[corners[i, k]]``, k = 0..2: piecewise-affine warping.
    """
    for i in range(len(corners)):
        x = y = 0.0
        for k in range(3):
            x += weights[i, k] * points[corners[i, k], 0]
            y += weights[i, k] * points[corners[i, k], 1]
        for c in range(out.shape[1]):
            out[i, c] = bilinear(picture, x, y, c)
