"""Texels of a texture: the pixels that lie on a mesh's surface, and interpolation of vertex values at them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

ISLANDS_TOP = 0.815  # v at which the layout of the shipped heads has mouth, neck and eye sockets, below the head


@dataclass(frozen=True, slots=True, eq=False)
class Texels:
    """Texels on the surface: rows and columns (P,), corners and barycentric weights in their triangles (P, 3)."""

    rows: NDArray[np.int64]
    columns: NDArray[np.int64]
    corners: NDArray[np.int64]
    weights: Floats

    def interpolate(self, values: Floats) -> Floats:
        """(P, D) values at the texels, interpolated from vertex values (N, D)."""
        interpolated: Floats = np.einsum("pk,pkd->pd", self.weights, values[self.corners])
        return interpolated


def find_texels(uv: Floats, triangles: NDArray[np.int64], side: int) -> Texels:
    """The texels whose centres lie in a triangle; where triangles overlap, in the last one."""
    places = uv * side - 0.5
    owner = np.full((side, side), -1)
    for number, corners in enumerate(places[triangles]):
        low, high = np.ceil(corners.min(axis=0) - 1e-9).astype(int), np.floor(corners.max(axis=0) + 1e-9).astype(int)
        if (high < low).any():
            continue
        x, y = np.meshgrid(np.arange(low[0], high[0] + 1), np.arange(low[1], high[1] + 1))
        inside = (_barycentric(corners, x.ravel(), y.ravel()) >= -1e-6).all(axis=1).reshape(x.shape)
        owner[y[inside], x[inside]] = number
    rows, columns = np.nonzero(owner >= 0)
    chosen = triangles[owner[rows, columns]]
    weights = _barycentric(places[chosen].transpose(1, 2, 0), columns, rows)
    return Texels(rows, columns, chosen, weights)


def _barycentric(corners: Floats, x: NDArray[np.int64], y: NDArray[np.int64]) -> Floats:
    """(P, 3) weights of points in a triangle; `corners` is (3, 2) or (3, 2, P)."""
    (ax, ay), (bx, by), (cx, cy) = corners
    area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    area = np.where(np.abs(area) < 1e-12, 1e-12, area)
    second = ((x - ax) * (cy - ay) - (y - ay) * (cx - ax)) / area
    third = ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) / area
    return np.stack([1 - second - third, second, third], axis=1)
