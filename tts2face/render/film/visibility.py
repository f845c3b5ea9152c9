"""The nearest triangle of each sample: spans of rows, and one integer for depth and triangle.

Every kernel releases the interpreter's lock and runs on one thread; each picture is drawn by one thread, so its bytes
do not depend on the number of threads. Both triangles at an edge compute the same end of their spans and include it,
so that no sample falls between them. Picture space: x right, y down, in samples.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.compilation import kernel

Array = NDArray[Any]

X, Y, NEAR, U, V, RED, GREEN, BLUE = range(8)  # columns of a table of projected vertices
N_COLUMNS = 8
TRIANGLE_BITS = 20
MAX_TRIANGLES = (1 << TRIANGLE_BITS) - 2
TRIANGLE_MASK = (1 << TRIANGLE_BITS) - 1  # of the triangle's number plus one in a sample
DEPTH_SCALE = np.float32(2.0**41)  # of 1/z in 1/mm: 43 bits beside the triangle's, from 1 mm to 100 m
BLOCK = 4  # samples at once, without a branch: spans are three to five long on average
FIRST_OF_BLOCK = np.where(np.arange(BLOCK) < np.arange(BLOCK + 1)[:, None], -1, 0)  # all bits of the first n samples
LEAST_AREA = np.float32(1e-3)  # twice that of a triangle that is drawn, in samples


@kernel
def project(points: Array, source: Array, view: Array, lens: Array, table: Array) -> None:
    """Write columns X, Y and NEAR (1/mm; 0 nearer than the near plane) of the world points (P, 3), mm, of rows (V,).

    `view` (3, 4) transforms world to camera space; `lens` is (focal length in samples, centre x, centre y, near plane).
    Samples have whole coordinates at their centres.
    """
    half, one = np.float32(0.5), np.float32(1)
    for v in range(len(source)):
        p = source[v]
        x, y, z = points[p, 0], points[p, 1], points[p, 2]
        right = view[0, 0] * x + view[0, 1] * y + view[0, 2] * z + view[0, 3]
        down = view[1, 0] * x + view[1, 1] * y + view[1, 2] * z + view[1, 3]
        ahead = view[2, 0] * x + view[2, 1] * y + view[2, 2] * z + view[2, 3]
        near = one / ahead if ahead >= lens[3] else np.float32(0)
        table[v, X] = lens[1] + lens[0] * right * near - half
        table[v, Y] = lens[2] + lens[0] * down * near - half
        table[v, NEAR] = near


@kernel
def find_bands(table: Array, triangles: Array, rows: tuple[int, int], bands: Array, counts: Array) -> None:
    """Write the bands of rows that triangles touch, and the number of triangles in each band.

    A band's samples stay in the processor's cache while its triangles are drawn.

    Parameters
    ----------
    table : (V, 8)
        Projected vertices.
    triangles : (F, 3)
        Vertex indices, counter-clockwise as seen.
    rows
        Rows of samples of the picture and of a band.
    bands : (F, 2)
        Out: the first band and the end of the bands; none for a triangle that does not face the camera.
    counts : (B,)
        Out.
    """
    height, band_rows = rows
    for band in range(len(counts)):
        counts[band] = 0
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        ax, ay, bx, by, cx, cy = table[a, X], table[a, Y], table[b, X], table[b, Y], table[c, X], table[c, Y]
        low, high = np.ceil(min(ay, by, cy)), np.floor(max(ay, by, cy))
        bands[t, 1] = bands[t, 0] = 0
        if (bx - ax) * (cy - ay) - (cx - ax) * (by - ay) > -LEAST_AREA or low > high or high < 0 or low >= height:
            continue
        bands[t, 0], bands[t, 1] = max(int(low), 0) // band_rows, min(int(high), height - 1) // band_rows + 1
        for band in range(bands[t, 0], bands[t, 1]):
            counts[band] += 1


@kernel
def fill_bands(bands: Array, ends: Array, order: Array) -> None:
    """Write the numbers (n,) of the triangles of each band one after the other, from the ends (B,) of the bands."""
    for t in range(len(bands) - 1, -1, -1):
        for band in range(bands[t, 0], bands[t, 1]):
            ends[band] -= 1
            order[ends[band]] = t


@kernel
def find_nearest(
    table: Array, triangles: Array, order: Array, first_row: int, nearest: Array, ends: Array
) -> tuple[int, int]:
    """Write the nearest triangle that faces the camera in each sample; returns the columns [first, end) that hold any.

    Parameters
    ----------
    table : (V, 8)
        Projected vertices.
    triangles : (F, 3)
        Vertex indices, counter-clockwise as seen; those with a vertex nearer than the near plane are not drawn.
    order : (n,)
        The triangles that are drawn.
    first_row
        The picture's row of samples that is the first of `nearest`.
    nearest : (H, W + BLOCK) int64
        Out: 1/z in the high bits, the triangle's number plus one in the low ones; the largest wins. 0 where none is.
    ends : (2, H + BLOCK)
        Scratch space: both ends of a triangle's spans.
    """
    height, stride = nearest.shape
    line = nearest.reshape(-1)
    for sample in range(len(line)):
        line[sample] = 0
    top_row, end_row = np.float32(first_row), np.float32(first_row + height - 1)
    left_end, right_end = np.float32(0), np.float32(stride - BLOCK - 1)
    first_column, last_column = stride, -1
    for t in order:
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        ax, ay, bx, by, cx, cy = table[a, X], table[a, Y], table[b, X], table[b, Y], table[c, X], table[c, Y]
        area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
        if area > -LEAST_AREA:
            continue
        low, high = np.ceil(max(min(ay, by, cy), top_row)), np.floor(min(max(ay, by, cy), end_row))
        from_column, to_column = np.ceil(max(min(ax, bx, cx), left_end)), np.floor(min(max(ax, bx, cx), right_end))
        if low > high or from_column > to_column:
            continue
        az, bz, cz = table[a, NEAR], table[b, NEAR], table[c, NEAR]
        if min(az, bz, cz) <= 0:
            continue
        first_column, last_column = min(first_column, int(from_column)), max(last_column, int(to_column))
        inverse = np.float32(1) / area
        across = ((bz - az) * (cy - ay) - (cz - az) * (by - ay)) * inverse
        along = ((cz - az) * (bx - ax) - (bz - az) * (cx - ax)) * inverse
        origin = az - across * ax - along * ay
        if by < ay:
            ax, ay, bx, by = bx, by, ax, ay
        if cy < by:
            bx, by, cx, cy = cx, cy, bx, by
            if by < ay:
                ax, ay, bx, by = bx, by, ax, ay
        whole = (cx - ax) / (cy - ay)
        upper = (bx - ax) / (by - ay) if by > ay else np.float32(0)
        lower = (cx - bx) / (cy - by) if cy > by else np.float32(0)
        step = np.int64(across * DEPTH_SCALE) << TRIANGLE_BITS
        number = np.int64(t + 1)
        top, n_rows = int(low) - first_row, int(high) + 1 - int(low)
        for block in range(0, n_rows, BLOCK):  # ends of the spans, of several rows at once
            for row in range(block, block + BLOCK):
                y = low + np.float32(row)
                one_side, below = ax + whole * (y - ay), bx + lower * (y - by)
                other = ax + upper * (y - ay) if y < by else below
                ends[0, row] = np.ceil(max(min(one_side, other), left_end))
                ends[1, row] = np.floor(min(max(one_side, other), right_end))
        for row in range(n_rows):
            left, y = ends[0, row], low + np.float32(row)
            count = int(ends[1, row]) + 1 - int(left)
            depth = np.int64((origin + across * left + along * y) * DEPTH_SCALE) << TRIANGLE_BITS | number
            at = np.uint64((top + row) * stride + int(left))
            while count > 0:
                n = min(count, BLOCK)
                for i in range(BLOCK):
                    own, old = (depth + i * step) & FIRST_OF_BLOCK[n, i], line[at + np.uint64(i)]
                    line[at + np.uint64(i)] = own if own > old else old
                depth, at, count = depth + BLOCK * step, at + np.uint64(BLOCK), count - BLOCK
    return min(first_column, last_column + 1), last_column + 1


def nearest_triangles(table: Array, triangles: Array, shape: tuple[int, int]) -> tuple[NDArray[np.int64], int, int]:
    """Samples (H, W + BLOCK) of a whole picture (H, W), and the columns with any, as `find_nearest` writes them."""
    nearest = np.zeros((shape[0], shape[1] + BLOCK), np.int64)
    ends = np.zeros((2, shape[0] + BLOCK), np.float32)
    return nearest, *find_nearest(table, triangles, np.arange(len(triangles), dtype=np.int32), 0, nearest, ends)
