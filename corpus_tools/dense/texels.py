"""Texels of a texture: the pixels that lie on a mesh's surface, and interpolation of vertex values at them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tts2face.numeric.arrays import FloatArray
from tts2face.numeric.kernels import kernel

LEAST_SPREAD = 6.0  # of a blur in pixels of a reduced picture, at which it differs by less than .001 of the values
ISLANDS_TOP = 0.815  # v at which the layout of the shipped heads has mouth, neck and eye sockets, below the head


@dataclass(frozen=True, slots=True, eq=False)
class Texels:
    """Texels on the surface: rows and columns (P,), corners and barycentric weights in their triangles (P, 3)."""

    rows: NDArray[np.int64]
    columns: NDArray[np.int64]
    corners: NDArray[np.int64]
    weights: FloatArray

    def at(self, numbers: NDArray[np.int64]) -> "Texels":
        """The texels of these numbers."""
        return Texels(self.rows[numbers], self.columns[numbers], self.corners[numbers], self.weights[numbers])

    def interpolate(self, values: FloatArray) -> FloatArray:
        """(P, D) values at the texels, interpolated from vertex values (N, D)."""
        interpolated = np.zeros((len(self.rows), values.shape[1]))
        _interpolate(self.corners, self.weights, values, interpolated)
        return interpolated

    def block_means(self, side: int, *values: FloatArray) -> list[FloatArray]:
        """Means (B, D) of values (P, D) over the squares of `side` texels that hold any."""
        squares = np.column_stack([self.rows // side, self.columns // side])
        _, square, count = np.unique(squares, axis=0, return_inverse=True, return_counts=True)
        sums = [[np.bincount(square.ravel(), column) / count for column in own.T] for own in values]
        return [np.column_stack(columns) for columns in sums]

    def blurred(self, values: FloatArray, side: int, spread: float) -> FloatArray:
        """(P, D) values (P, D) in a picture that is 0 elsewhere, blurred by a Gaussian of `spread` texels."""
        found = np.zeros_like(values)
        for channel, own in enumerate(values.T):
            picture = np.zeros((side, side), np.float32)
            picture[self.rows, self.columns] = own
            found[:, channel] = blur(picture, spread)[self.rows, self.columns]
        return found


def blur(picture: NDArray[np.float32], spread: float) -> NDArray[np.float32]:
    """A picture (S, S) blurred by a Gaussian of `spread` pixels; a broad blur is computed in a reduced picture."""
    import cv2

    step = max(int(spread / LEAST_SPREAD), 1)
    small = cv2.resize(picture, None, fx=1 / step, fy=1 / step, interpolation=cv2.INTER_AREA)
    soft = cv2.GaussianBlur(small, (0, 0), spread / step, borderType=cv2.BORDER_REFLECT)
    return np.asarray(cv2.resize(soft, picture.shape[::-1], interpolation=cv2.INTER_LINEAR), np.float32)


def find_texels(uv: FloatArray, triangles: NDArray[np.int64], side: int) -> Texels:
    """The texels whose centres lie in a triangle; where triangles overlap, in the last one."""
    places = uv * side - 0.5
    owner, weights = np.full((side, side), -1), np.zeros((side, side, 3))
    _find_owners(places[triangles], owner, weights)
    rows, columns = np.nonzero(owner >= 0)
    return Texels(rows, columns, triangles[owner[rows, columns]], weights[rows, columns])


@kernel
def _interpolate(corners, weights, values, interpolated):  # type: ignore[no-untyped-def]
    """Write weighted sums (P, D) of the values (N, D) at corners (P, 3)."""
    for p in range(len(corners)):
        a, b, c = corners[p]
        for d in range(values.shape[1]):
            interpolated[p, d] = (
                weights[p, 0] * values[a, d] + weights[p, 1] * values[b, d] + weights[p, 2] * values[c, d]
            )


@kernel
def _find_owners(corners, owner, weights):  # type: ignore[no-untyped-def]
    """Write into each texel the last triangle (T, 3, 2) in which its centre lies, and its barycentric weights there."""
    for number in range(len(corners)):
        (ax, ay), (bx, by), (cx, cy) = corners[number]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if abs(area) < 1e-12:
            # a triangle without an area in the texture must not divide by 0
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
