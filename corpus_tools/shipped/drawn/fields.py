"""Geometry of the drawn characters: bumps in space, smooth lines, surfaces in rows."""

from collections.abc import Iterable

import numpy as np
from scipy.interpolate import CubicSpline, PchipInterpolator
from scipy.ndimage import gaussian_filter1d, maximum_filter1d
from scipy.spatial import cKDTree

from tts2face.numeric.arrays import FloatArray


def bump(points: FloatArray, centre: tuple[float, ...], reach: tuple[float, ...]) -> FloatArray:
    """(P,) Gaussian with value 1 at the centre; `gaussian_bump` of the head is that of both sides."""
    falling: FloatArray = np.exp(-(((points - np.array(centre)) / np.array(reach)) ** 2).sum(axis=1))
    return falling


def smooth_line(points: Iterable[Iterable[float]], n: int) -> FloatArray:
    """(n, D) points at equal steps along the cubic spline through points (K, D)."""
    known = np.array([tuple(point) for point in points], np.float64)
    along = arc_length(known)
    return np.asarray(CubicSpline(along, known)(np.linspace(0, along[-1], n)))


def arc_length(points: FloatArray) -> FloatArray:
    """(K,) length of a line of points (K, D) up to each of them."""
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])


def profile(knots: Iterable[tuple[float, float]], at: FloatArray) -> FloatArray:
    """Values of a monotone cubic through (share, value) at shares (n,)."""
    return np.asarray(PchipInterpolator(*np.array(list(knots)).T)(at))


def smooth_rows(values: FloatArray, spread: float) -> FloatArray:
    """Values (n, ...) after a Gaussian along their first axis, in steps."""
    return np.asarray(gaussian_filter1d(values, spread, axis=0, mode="nearest"))


class Front:
    """Points that lie in front, seen along z, of lines that must not sink into a surface (N, 3)."""

    def __init__(self, surface: FloatArray) -> None:
        self._depth, self._places = surface[:, 2], cKDTree(surface[:, :2])

    def lacking(self, points: FloatArray, gap: float) -> FloatArray:
        """(n,) mm by which points (n, 3) of a line must come forward to lie `gap` in front of the surface, smoothed."""
        near = self._places.query(points[:, :2], 4)[1]
        lack = np.maximum(self._depth[near].max(axis=1) + gap - points[:, 2], 0)
        return np.asarray(gaussian_filter1d(maximum_filter1d(lack, 5), 3))
