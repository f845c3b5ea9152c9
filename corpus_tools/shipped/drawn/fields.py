"""Helpers of the drawn characters' geometry: bumps in space, smooth lines, surfaces in rows.

Layout of the texture of hair and clothes, and surfaces that are cut open along its seams.
"""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline, PchipInterpolator
from scipy.ndimage import gaussian_filter1d, maximum_filter1d
from scipy.spatial import cKDTree

from lexicon.errors import DataError

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def bump(points: Floats, centre: tuple[float, ...], reach: tuple[float, ...]) -> Floats:
    """(P,) Gaussian with value 1 at the centre; `gaussian_bump` of the head is that of both sides."""
    falling: Floats = np.exp(-(((points - np.array(centre)) / np.array(reach)) ** 2).sum(axis=1))
    return falling


def smooth_line(points: Iterable[Iterable[float]], n: int) -> Floats:
    """(n, D) points at equal steps along the cubic spline through points (K, D)."""
    known = np.array([tuple(point) for point in points], np.float64)
    along = arc_length(known)
    return np.asarray(CubicSpline(along, known)(np.linspace(0, along[-1], n)))


def arc_length(points: Floats) -> Floats:
    """(K,) length of a line of points (K, D) up to each of them."""
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])


def profile(knots: Iterable[tuple[float, float]], at: Floats) -> Floats:
    """Values of a monotone cubic through (share, value) at shares (n,)."""
    return np.asarray(PchipInterpolator(*np.array(list(knots)).T)(at))


def smooth_rows(values: Floats, spread: float) -> Floats:
    """Values (n, ...) after a Gaussian along their first axis, in steps."""
    return np.asarray(gaussian_filter1d(values, spread, axis=0, mode="nearest"))


def wind_outward(points: Floats, triangles: Ints, about: Floats | float = 0.0) -> Ints:
    """Triangles (F, 3) of a closed surface whose normals point away from `about`."""
    a, b, c = (points[triangles] - about).transpose(1, 0, 2)
    return triangles if np.einsum("fc,fc->f", a, np.cross(b, c)).sum() > 0 else triangles[:, ::-1]


class Front:
    """What lies in front, seen along z, of lines that must not sink into a surface (N, 3)."""

    def __init__(self, surface: Floats) -> None:
        self._depth, self._places = surface[:, 2], cKDTree(surface[:, :2])

    def lacking(self, points: Floats, gap: float) -> Floats:
        """(n,) mm by which points (n, 3) of a line must come forward to lie `gap` in front of the surface, smoothed."""
        near = self._places.query(points[:, :2], 4)[1]
        lack = np.maximum(self._depth[near].max(axis=1) + gap - points[:, 2], 0)
        return np.asarray(gaussian_filter1d(maximum_filter1d(lack, 5), 3))


Tile = tuple[float, float, float, float]  # left, right, top and bottom, v down

MARGIN = 0.004  # between tiles: four texels of 1024
HAIR_BOTTOM = 0.62  # the tiles of hair lie above it
N_COLUMNS, N_ROWS = 8, 3  # of these tiles, which are longer than wide on the hair: streaks run along them
SHIRT: Tile = (0.0, 1.0, HAIR_BOTTOM, 0.87)
COLLAR: Tile = (0.0, 1.0, 0.87, 1.0)


def hair_tiles(number: int) -> list[Tile]:
    """Equal tiles of so many locks.

    Raises
    ------
    DataError
        There are more locks than tiles.
    """
    if number > N_COLUMNS * N_ROWS:
        raise DataError(f"a texture has tiles for {N_COLUMNS * N_ROWS} locks, not {number}; join some of them")
    columns, rows = (2, 1) if number <= 2 else (N_COLUMNS, N_ROWS)  # curls all over are one large surface
    wide, high = 1.0 / columns, HAIR_BOTTOM / rows
    places = [divmod(at, columns) for at in range(number)]
    return [(column * wide, (column + 1) * wide, row * high, (row + 1) * high) for row, column in places]


def strand_places(uv: Floats) -> Floats:
    """(N, 3) places for the noise of hair at texture coordinates (N, 2): along and across locks, and their row."""
    along, across = uv[:, 1] * N_ROWS / HAIR_BOTTOM, uv[:, 0] * N_COLUMNS
    return np.column_stack([along, across, np.floor(along)])


def in_tile(tile: Tile, across: Floats, down: Floats) -> Floats:
    """(N, 2) texture coordinates of places (N,) and (N,) in 0..1 within a tile."""
    left, right, top, bottom = tile
    u = left + MARGIN + across * (right - left - 2 * MARGIN)
    v = top + MARGIN + down * (bottom - top - 2 * MARGIN)
    return np.column_stack([u, v])


def cut_seam(triangles: Ints, turn: Floats) -> tuple[Ints, Ints, Floats]:
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
