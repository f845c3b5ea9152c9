"""Texels of a texture: the pixels that lie on a mesh's surface, and interpolation of vertex values at them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tts2face.compilation import kernel

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
    owner, weights = np.full((side, side), -1), np.zeros((side, side, 3))
    _find_owners(places[triangles], owner, weights)
    rows, columns = np.nonzero(owner >= 0)
    return Texels(rows, columns, triangles[owner[rows, columns]], weights[rows, columns])


@kernel
def _find_owners(corners, owner, weights):  # type: ignore[no-untyped-def]
    """Write into each texel the last triangle (T, 3, 2) in which its centre lies, and its barycentric weights there."""
    for number in range(len(corners)):
        (ax, ay), (bx, by), (cx, cy) = corners[number]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if abs(area) < 1e-12:
            area = 1e-12
        last = len(owner) - 1
        low_x, high_x = max(0, np.ceil(min(ax, bx, cx) - 1e-9)), min(last, np.floor(max(ax, bx, cx) + 1e-9))
        low_y, high_y = max(0, np.ceil(min(ay, by, cy) - 1e-9)), min(last, np.floor(max(ay, by, cy) + 1e-9))
        for y in range(int(low_y), int(high_y) + 1):
            for x in range(int(low_x), int(high_x) + 1):
                second = ((x - ax) * (cy - ay) - (y - ay) * (cx - ax)) / area
                third = ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) / area
                first = 1 - second - third
                if min(first, second, third) >= -1e-6:
                    owner[y, x] = number
                    weights[y, x, 0], weights[y, x, 1], weights[y, x, 2] = first, second, third
