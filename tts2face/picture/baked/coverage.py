"""Coverage of pixels at the edges of a transparent picture: of 64 places in each, those that any triangle covers.

The samples of colours are too few: with two by two of them an edge of hair has five levels.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.numeric.arrays import Array
from tts2face.numeric.kernels import HALF, UNIT, ZERO, kernel
from tts2face.picture.baked.visibility import LEAST_AREA, NEAR, X, Y

FINE = 8  # places along a pixel's side, one bit each of a number for each row
FULL = (1 << FINE) - 1
N_BITS = np.array([number.bit_count() for number in range(1 << FINE)], np.int32)


@kernel
def _cover_pixel(corners: tuple[tuple[Any, Any], ...], place: tuple[int, int, int], rows: Array) -> None:
    """Set the bits of the places that a triangle with corners (x, y), in pixels, covers in one, of a row (8,)."""
    across, down, n = place
    fine = np.float32(FINE)
    for row in range(FINE):
        if rows[n, row] == FULL:
            continue
        y = np.float32(down) + (np.float32(row) + HALF) / fine
        low, high = np.float32(across), np.float32(across + 1)
        for edge in range(3):
            x0, y0 = corners[edge]
            x1, y1 = corners[edge + 1]
            # inside where along * x <= level
            along, level = y0 - y1, (y0 - y1) * x0 + (x1 - x0) * (y0 - y)
            bound = level / along if along != ZERO else ZERO
            high = min(high, bound) if along > ZERO else high
            low = max(low, bound) if along < ZERO else low
            high = low - UNIT if (along == ZERO) & (level < ZERO) else high
        first = int(np.ceil(max((low - np.float32(across)) * fine - HALF, ZERO)))
        last = int(np.floor(min((high - np.float32(across)) * fine - HALF, fine - UNIT)))
        if last >= first:
            rows[n, row] |= (1 << (last + 1)) - (1 << first)


@kernel
def cover_pixels(table: Array, triangles: Array, side: int, number_of: Array, rows: Array) -> None:
    """Set the bits of the places that triangles (F, 3), which face the camera, cover in some pixels.

    Parameters
    ----------
    table : (V, 8)
        Vertices, projected to samples of which a pixel has `side` along its side.
    number_of : (H, W)
        Row of ``rows`` of each pixel; -1 of others.
    rows : (N, 8)
        In and out: bits of the places in the rows of pixels.
    """
    height, width = number_of.shape
    scale = UNIT / np.float32(side)
    least = -LEAST_AREA * scale * scale
    end_x, end_y = np.float32(width) - UNIT, np.float32(height) - UNIT
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        ax, ay = (table[a, X] + HALF) * scale, (table[a, Y] + HALF) * scale
        bx, by = (table[b, X] + HALF) * scale, (table[b, Y] + HALF) * scale
        cx, cy = (table[c, X] + HALF) * scale, (table[c, Y] + HALF) * scale
        faces = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay) <= least
        if not (faces & (min(table[a, NEAR], table[b, NEAR], table[c, NEAR]) > ZERO)):
            continue
        left, right = max(np.floor(min(ax, bx, cx)), ZERO), min(np.floor(max(ax, bx, cx)), end_x)
        top, bottom = max(np.floor(min(ay, by, cy)), ZERO), min(np.floor(max(ay, by, cy)), end_y)
        corners = ((ax, ay), (bx, by), (cx, cy), (ax, ay))
        for down in range(int(top), int(bottom) + 1):
            for across in range(int(left), int(right) + 1):
                n = number_of[down, across]
                if n >= 0:
                    _cover_pixel(corners, (across, down, n), rows)


def _of_three(least_or_most: np.ufunc, padded: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """(H, W) least or most of the three by three pixels around each, of which there is one more on each side."""
    rows = least_or_most(least_or_most(padded[:-2], padded[1:-1]), padded[2:])
    found: NDArray[np.uint8] = least_or_most(least_or_most(rows[:, :-2], rows[:, 1:-1]), rows[:, 2:])
    return found


def refine_edges(table: Array, triangles: Array, side: int, picture: NDArray[np.uint8]) -> None:
    """Write the coverage of the pixels at edges of a picture (H, W, 4), in place; new ones take a colour beside."""
    alpha = np.pad(picture[..., 3], 1, mode="edge")
    height, width = picture.shape[:2]
    is_edge = _of_three(np.minimum, alpha) < _of_three(np.maximum, alpha)
    chosen = np.flatnonzero(is_edge)
    number_of = np.full((height, width), -1, np.int32)
    number_of.ravel()[chosen] = np.arange(len(chosen), dtype=np.int32)
    rows = np.zeros((len(chosen), FINE), np.int32)
    cover_pixels(table, triangles, side, number_of, rows)
    cover = N_BITS[rows].sum(axis=1) / FINE**2
    down, across = np.divmod(chosen, width)
    bare = (alpha[down + 1, across + 1] == 0) & (cover > 0)
    y, x = down[bare], across[bare]
    way = np.stack([alpha[y + step // 3, x + step % 3] for step in range(9)]).argmax(axis=0)
    picture[y, x, :3] = picture[(y + way // 3 - 1).clip(0, height - 1), (x + way % 3 - 1).clip(0, width - 1), :3]
    picture[down, across, 3] = np.rint(255 * cover).astype(np.uint8)
