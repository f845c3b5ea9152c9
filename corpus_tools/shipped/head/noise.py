"""Smooth random fields over points in space, for colours without seams."""

import numpy as np
from scipy.ndimage import map_coordinates

from tts2face.numeric.arrays import FloatArray

SIZE = 32  # lattice points along each axis; the field is periodic


def value_noise(points: FloatArray, size_mm: float, generator: np.random.Generator) -> FloatArray:
    """(P,) value noise of about -1..1 with features of about `size_mm`, at points (P, 3) in mm."""
    lattice = generator.standard_normal((SIZE, SIZE, SIZE))
    field = map_coordinates(lattice, (points / size_mm).T % SIZE, order=1, mode="grid-wrap")
    return np.clip(field / 1.2, -2, 2)


def gaussian_bump(points: FloatArray, centre: tuple[float, ...], reach: tuple[float, ...]) -> FloatArray:
    """(P,) Gaussian with value 1 at the centre, symmetric in x."""
    mirrored = np.column_stack([np.abs(points[:, 0]), points[:, 1:]])[:, : len(centre)]
    falling: FloatArray = np.exp(-(((mirrored - np.array(centre)) / np.array(reach)) ** 2).sum(axis=1))
    return falling
