"""Piecewise affine warps: a plate with an added texture change, drawn triangle by triangle.

Pixel coordinates have their origin at the centre of the top left pixel. Every kernel releases the interpreter's lock
and runs on one thread.
"""

from typing import Any

import numpy as np

from tts2face.numeric.arrays import Array
from tts2face.numeric.kernels import inlined_kernel, kernel

EDGE_TOLERANCE = -1e-6  # least barycentric coordinate inside a triangle: leaves no gap between neighbours


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


@inlined_kernel
def triangle_corner(points: Array, triangle: Array, k: int) -> tuple[float, float]:
    """Coordinates (x, y) of corner k of a triangle."""
    return points[triangle[k], 0], points[triangle[k], 1]


@kernel
def warp_image(
    triangles: Array, target: Array, source: Array, plate: Array, change: tuple[Any, Any], frame: Array
) -> None:
    """Draw the triangles of a plate at target positions, with an added texture change.

    Parameters
    ----------
    triangles : (F, 3)
        Point indices; later triangles cover earlier ones.
    target, source : (N, 2), (N, 2)
        Point positions in the frame and in the plate, pixels.
    plate : (H, W, 3)
        Source picture.
    change
        Texture (h, w, 3) to add, and the positions (M, 2), M <= N, of the first M points in it; triangles with other
        points are warped without it. With M = 0 the plate is drawn as it is.
    frame : (H', W', 3) float32
        Out: the picture, written in place.
    """
    texture, places = change
    height, width = frame.shape[0], frame.shape[1]
    for f in range(len(triangles)):
        triangle = triangles[f]
        x0, y0 = triangle_corner(target, triangle, 0)
        x1, y1 = triangle_corner(target, triangle, 1)
        x2, y2 = triangle_corner(target, triangle, 2)
        area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
        if abs(area) < 1e-9:
            continue
        left, right = max(int(np.ceil(min(x0, x1, x2))), 0), min(int(max(x0, x1, x2)), width - 1)
        top, bottom = max(int(np.ceil(min(y0, y1, y2))), 0), min(int(max(y0, y1, y2)), height - 1)
        is_face = max(triangle[0], triangle[1], triangle[2]) < len(places)
        for y in range(top, bottom + 1):
            for x in range(left, right + 1):
                b = ((x - x0) * (y2 - y0) - (x2 - x0) * (y - y0)) / area
                c = ((x1 - x0) * (y - y0) - (x - x0) * (y1 - y0)) / area
                a = 1.0 - b - c
                if min(a, b, c) < EDGE_TOLERANCE:
                    continue
                u = a * source[triangle[0], 0] + b * source[triangle[1], 0] + c * source[triangle[2], 0]
                v = a * source[triangle[0], 1] + b * source[triangle[1], 1] + c * source[triangle[2], 1]
                for k in range(3):
                    frame[y, x, k] = interpolate_bilinear(plate, u, v, k)
                if is_face:
                    u = a * places[triangle[0], 0] + b * places[triangle[1], 0] + c * places[triangle[2], 0]
                    v = a * places[triangle[0], 1] + b * places[triangle[1], 1] + c * places[triangle[2], 1]
                    for k in range(3):
                        frame[y, x, k] += interpolate_bilinear(texture, u, v, k)
