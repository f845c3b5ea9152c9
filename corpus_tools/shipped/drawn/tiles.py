"""Layout of the texture of hair and clothes, and surfaces that are cut open along its seams."""

import numpy as np

from lexicon.errors import DataError
from tts2face.numeric.arrays import FloatArray, IntArray

Tile = tuple[float, float, float, float]  # left, right, top and bottom, v down
MARGIN = 0.004  # between tiles: four texels of 1024
HAIR_BOTTOM = 0.62  # the tiles of hair lie above it
N_COLUMNS, N_ROWS = 8, 3  # of these tiles, which are longer than wide on the hair: streaks run along them
SHIRT: Tile = (0.0, 1.0, HAIR_BOTTOM, 0.87)
COLLAR: Tile = (0.0, 1.0, 0.87, 1.0)


def hair_tiles(number: int) -> list[Tile]:
    """Equal tiles of so many locks."""
    if number > N_COLUMNS * N_ROWS:
        raise DataError(f"a texture has tiles for {N_COLUMNS * N_ROWS} locks, not {number}; join some of them")
    columns, rows = (2, 1) if number <= 2 else (N_COLUMNS, N_ROWS)  # curls all over are one large surface
    wide, high = 1.0 / columns, HAIR_BOTTOM / rows
    places = [divmod(at, columns) for at in range(number)]
    return [(column * wide, (column + 1) * wide, row * high, (row + 1) * high) for row, column in places]


def strand_places(uv: FloatArray) -> FloatArray:
    """(N, 3) places for the noise of hair at texture coordinates (N, 2): along and across locks, and their row."""
    along, across = uv[:, 1] * N_ROWS / HAIR_BOTTOM, uv[:, 0] * N_COLUMNS
    return np.column_stack([along, across, np.floor(along)])


def in_tile(tile: Tile, across: FloatArray, down: FloatArray) -> FloatArray:
    """(N, 2) texture coordinates of places (N,) and (N,) in 0..1 within a tile."""
    left, right, top, bottom = tile
    u = left + MARGIN + across * (right - left - 2 * MARGIN)
    v = top + MARGIN + down * (bottom - top - 2 * MARGIN)
    return np.column_stack([u, v])


def cut_seam(triangles: IntArray, turn: FloatArray) -> tuple[IntArray, IntArray, FloatArray]:
    """Cut a surface where a place around an axis (N,), in 0..1, jumps from 1 to 0.

    Returns
    -------
    vertices : (M,)
        The old vertex of each new one; the first N stay.
    triangles : (F, 3)
    turn : (M,)
        Copies have the turn of their vertex plus 1.
    """
    at = turn[triangles]
    crosses = (np.ptp(at, axis=1) > 0.5)[:, None] & (at < 0.5)
    copied, number = np.unique(triangles[crosses], return_inverse=True)
    cut = triangles.copy()
    cut[crosses] = len(turn) + number
    return np.concatenate([np.arange(len(turn)), copied]), cut, np.concatenate([turn, turn[copied] + 1.0])
