"""Smooth random fields over points in space, for colours without seams."""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

Floats = NDArray[np.float64]

SIZE = 32  # lattice points along each axis; the field is periodic


def value_noise(points: Floats, size_mm: float, generator: np.random.Generator) -> Floats:
    """(P,) value noise of about -1..1 with features of about `size_mm`, at points (P, 3) in mm."""
    lattice = generator.standard_normal((SIZE, SIZE, SIZE))
    field = map_coordinates(lattice, (points / size_mm).T % SIZE, order=1, mode="grid-wrap")
    return np.clip(field / 1.2, -2, 2)


def gaussian_bump(points: Floats, centre: tuple[float, ...], reach: tuple[float, ...]) -> Floats:
    """(P,) Gaussian with value 1 at the centre, symmetric in x."""
    mirrored = np.column_stack([np.abs(points[:, 0]), points[:, 1:]])[:, : len(centre)]
    falling: Floats = np.exp(-(((mirrored - np.array(centre)) / np.array(reach)) ** 2).sum(axis=1))
    return falling


def stroke_cover(places: Floats, starts: Floats, ends: Floats, widths: Floats) -> Floats:
    """(P,) coverage of points (P, 2) by tapering strokes, 1 on a stroke's line; `widths` at the root, mm."""
    cover = np.zeros(len(places))
    for start, end, width in zip(starts, ends, widths, strict=True):
        near = np.flatnonzero(np.abs(places - (start + end) / 2).max(axis=1) < np.abs(end - start).max() / 2 + width)
        along = end - start
        share = np.clip((places[near] - start) @ along / (along @ along), 0, 1)
        off = np.linalg.norm(places[near] - start - share[:, None] * along, axis=1)
        cover[near] = np.maximum(cover[near], np.clip(1.3 - off / (width * (1.05 - 0.75 * share)), 0, 1))
    return cover
