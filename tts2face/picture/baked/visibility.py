"""The nearest triangle of each sample: spans of rows, and one integer for depth and triangle.

Every kernel releases the interpreter's lock and runs on one thread; each picture is drawn by one thread, so its bytes
do not depend on the number of threads. Both triangles at an edge compute the same end of their spans and include it,
so that no sample falls between them. Picture space: x right, y down, in samples.
"""

import numpy as np
from numpy.typing import NDArray

from tts2face.numeric.arrays import Array
from tts2face.numeric.kernels import BLOCK, HALF, UNIT, ZERO, flat_view, kernel, write_larger

X, Y, NEAR, U, V, RED, GREEN, BLUE = range(8)  # columns of a table of projected vertices
N_COLUMNS = 8
TRIANGLE_BITS = 20
MAX_TRIANGLES = (1 << TRIANGLE_BITS) - 2
TRIANGLE_MASK = (1 << TRIANGLE_BITS) - 1  # of the triangle's number plus one in a sample
DEPTH_SCALE = np.float32(2.0**41)  # of 1/z in 1/mm: 43 bits beside the triangle's, from 1 mm to 100 m
AT, COUNT, DEPTH, N_SPAN_VALUES = 0, BLOCK, 2 * BLOCK, 3 * BLOCK  # of the spans of a block of rows, in one array
LEAST_AREA = np.float32(1e-3)  # twice that of a triangle that is drawn, in samples


@kernel
def project(points: Array, source: Array, view: Array, lens: Array, table: Array) -> None:
    """Write columns X, Y and NEAR (1/mm; 0 nearer than the near plane) of the world points (P, 3), mm, of rows (V,).

    `view` (3, 4) transforms world to camera space; `lens` is (focal length in samples, centre x, centre y, near plane).
    Samples have whole coordinates at their centres.
    """
    for v in range(len(source)):
        p = source[v]
        x, y, z = points[p, 0], points[p, 1], points[p, 2]
        right = view[0, 0] * x + view[0, 1] * y + view[0, 2] * z + view[0, 3]
        down = view[1, 0] * x + view[1, 1] * y + view[1, 2] * z + view[1, 3]
        ahead = view[2, 0] * x + view[2, 1] * y + view[2, 2] * z + view[2, 3]
        near = UNIT / ahead if ahead >= lens[3] else np.float32(0)
        table[v, X] = lens[1] + lens[0] * right * near - HALF
        table[v, Y] = lens[2] + lens[0] * down * near - HALF
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
    bottom, band_rows = np.float32(rows[0] - 1), np.uint32(rows[1])
    for band in range(len(counts)):
        counts[band] = 0
    for t in range(len(triangles)):
        a, b, c = np.uint64(triangles[t, 0]), np.uint64(triangles[t, 1]), np.uint64(triangles[t, 2])
        ax, ay, bx, by, cx, cy = table[a, X], table[a, Y], table[b, X], table[b, Y], table[c, X], table[c, Y]
        low, high = np.ceil(max(min(ay, by, cy), ZERO)), np.floor(min(max(ay, by, cy), bottom))
        shown = ((bx - ax) * (cy - ay) - (cx - ax) * (by - ay) <= -LEAST_AREA) & (low <= high)
        first = np.int64(np.uint32(min(low, bottom)) // band_rows)
        end = np.int64(np.uint32(max(high, ZERO)) // band_rows) + 1 if shown else first
        bands[t, 0], bands[t, 1] = first, end
        for band in range(first, end):
            counts[band] += 1


@kernel
def fill_bands(bands: Array, ends: Array, order: Array) -> None:
    """Write the numbers (n,) of the triangles of each band one after the other, from the ends (B,) of the bands."""
    for t in range(len(bands) - 1, -1, -1):
        for band in range(bands[t, 0], bands[t, 1]):
            ends[band] -= 1
            order[ends[band]] = t


@kernel
def span_of_bands(bands: Array, numbers: Array) -> tuple[int, int]:
    """The first of the bands (F, 2) that triangles of some numbers (n,) touch, and one past the last."""
    first, end = np.int64(len(bands)), np.int64(0)
    for i in range(len(numbers)):
        low, high = np.int64(bands[numbers[i], 0]), np.int64(bands[numbers[i], 1])
        if high > low:
            first, end = min(first, low), max(end, high)
    return int(min(first, end)), int(end)


@kernel
def find_nearest(
    table: Array, triangles: Array, order: Array, first_row: int, nearest: Array, spans: Array
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
    spans : (N_SPAN_VALUES,) int64
        Scratch space: the first sample of each span of a triangle, their number, and the value of the first.

    Notes
    -----
    A triangle takes no branch that its shape decides: the processor would guess it wrongly. Its edges are sorted by
    conditional values, `BLOCK` rows have their spans at once, and a span its first `BLOCK` samples, of which few have
    more; spans without any change none.
    """
    height, stride = nearest.shape
    line = flat_view(nearest)
    for sample in range(len(line)):
        line[sample] = 0
    top_row, end_row = np.float32(first_row), np.float32(first_row + height - 1)
    left_end = np.float32(0)
    right_end = np.float32(stride - BLOCK - 1)
    beyond = right_end + np.float32(1)
    first_column, last_column = np.float32(stride), np.float32(-1)
    for t in order:
        a, b, c = np.uint64(triangles[t, 0]), np.uint64(triangles[t, 1]), np.uint64(triangles[t, 2])
        ax, ay, bx, by, cx, cy = table[a, X], table[a, Y], table[b, X], table[b, Y], table[c, X], table[c, Y]
        az, bz, cz = table[a, NEAR], table[b, NEAR], table[c, NEAR]
        area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
        low, high = np.ceil(max(min(ay, by, cy), top_row)), np.floor(min(max(ay, by, cy), end_row))
        from_column, to_column = np.ceil(max(min(ax, bx, cx), left_end)), np.floor(min(max(ax, bx, cx), right_end))
        if (area > -LEAST_AREA) | (low > high) | (from_column > to_column) | (min(az, bz, cz) <= 0):
            continue
        first_column, last_column = min(first_column, from_column), max(last_column, to_column)
        inverse = np.float32(1) / area
        across = ((bz - az) * (cy - ay) - (cz - az) * (by - ay)) * inverse
        along = ((cz - az) * (bx - ax) - (bz - az) * (cx - ax)) * inverse
        origin = az - across * ax - along * ay
        step, number = np.int64(across * DEPTH_SCALE) << TRIANGLE_BITS, np.int64(t + 1)
        swap = by < ay
        ax, bx, ay, by = bx if swap else ax, ax if swap else bx, by if swap else ay, ay if swap else by
        swap = cy < by
        bx, cx, by, cy = cx if swap else bx, bx if swap else cx, cy if swap else by, by if swap else cy
        swap = by < ay
        ax, bx, ay, by = bx if swap else ax, ax if swap else bx, by if swap else ay, ay if swap else by
        whole, upper, lower = (cx - ax) / (cy - ay), (bx - ax) / (by - ay), (cx - bx) / (cy - by)
        upper, lower = upper if by > ay else ZERO, lower if cy > by else ZERO
        first, n_rows = (int(low) - first_row) * stride, int(high) + 1 - int(low)
        for block in range(0, n_rows, BLOCK):
            for row in range(BLOCK):
                y = low + np.float32(block + row)
                one_side, below = ax + whole * (y - ay), bx + lower * (y - by)
                other = ax + upper * (y - ay) if y < by else below
                left = np.ceil(max(min(one_side, other), left_end))
                right = np.floor(min(max(one_side, other), right_end))
                spans[AT + row] = first + (block + row) * stride + np.int64(min(left, beyond))
                spans[COUNT + row] = np.int64(right) + 1 - np.int64(left)
                depth = np.int64((origin + across * left + along * y) * DEPTH_SCALE)
                spans[DEPTH + row] = depth << TRIANGLE_BITS | number
            for row in range(min(BLOCK, n_rows - block)):
                at, count, depth = spans[AT + row], spans[COUNT + row], spans[DEPTH + row]
                write_larger(nearest, at, count, depth, step)
                while count > BLOCK:
                    at, count, depth = at + BLOCK, count - BLOCK, depth + BLOCK * step
                    write_larger(nearest, at, count, depth, step)
    return int(min(first_column, last_column + 1)), int(last_column) + 1


def nearest_triangles(table: Array, triangles: Array, shape: tuple[int, int]) -> tuple[NDArray[np.int64], int, int]:
    """Samples (H, W + BLOCK) of a whole picture (H, W), and the columns with any, as `find_nearest` writes them."""
    nearest = np.zeros((shape[0], shape[1] + BLOCK), np.int64)
    every, spans = np.arange(len(triangles), dtype=np.int32), np.zeros(N_SPAN_VALUES, np.int64)
    return nearest, *find_nearest(table, triangles, every, 0, nearest, spans)
