"""The texture layout: MakeHuman's, its head enlarged so that eyes, nose and mouth get most pixels."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

SIDE = 1280  # pixels of the square texture
HEAD, BELOW = 0.80, 0.815  # rows of the head end, rows of the other islands begin
# Where MakeHuman's layout has the head, and within it the face from brows to chin and from eye to eye.
HEAD_BOX = ((0.638, 0.997), (0.145, 0.822))
FACE = ((0.872, 0.055), (0.4835, 0.085))  # centre and half width along u and v
FACE_GAIN = 4.0
ISLANDS = {  # box in MakeHuman's layout -> place in this one, both (u low, u high, v low, v high)
    "mouth": ((0.75, 0.93, 0.0, 0.14), (0.005, 0.235, BELOW, 0.995)),
    "neck": ((0.15, 0.62, 0.80, 1.0), (0.245, 0.695, BELOW, 0.995)),
    "sockets": ((0.008, 0.155, 0.54, 0.64), (0.705, 0.995, BELOW, 0.995)),
}


def laid_out(source_uv: Floats) -> Floats:
    """(N, 2) texture coordinates, v down, for MakeHuman's (N, 2), v up."""
    u, v = source_uv[:, 0], source_uv[:, 1]
    placed = np.column_stack([_stretched(u, HEAD_BOX[0], FACE[0]), HEAD * (1 - _stretched(v, HEAD_BOX[1], FACE[1]))])
    for (low_u, high_u, low_v, high_v), (left, right, top, bottom) in ISLANDS.values():
        inside = (u > low_u) & (u < high_u) & (v > low_v) & (v < high_v)
        across = left + (u - low_u) / (high_u - low_u) * (right - left)
        down = bottom - (v - low_v) / (high_v - low_v) * (bottom - top)
        placed[inside] = np.column_stack([across, down])[inside]
    return placed


def _stretched(values: Floats, box: tuple[float, float], face: tuple[float, float]) -> Floats:
    """The box brought to 0..1, a bell about the face's centre taking more room; rises everywhere."""
    grid = np.linspace(box[0], box[1], 2001)
    density = 1.0 + FACE_GAIN * np.exp(-(((grid - face[0]) / face[1]) ** 4))
    share = np.concatenate([[0], np.cumsum((density[1:] + density[:-1]) / 2)])
    placed: Floats = np.interp(values, grid, share / share[-1])
    return placed


@dataclass(frozen=True, slots=True, eq=False)
class Texels:
    """Pixels of the texture that lie on the surface: rows and columns (P,), and a triangle's corners and weights."""

    rows: NDArray[np.int64]
    columns: NDArray[np.int64]
    corners: NDArray[np.int64]
    weights: Floats

    def carried(self, values: Floats) -> Floats:
        """Values (N, D) of vertices brought to the texels, (P, D)."""
        found: Floats = np.einsum("pk,pkd->pd", self.weights, values[self.corners])
        return found


def texels_of(uv: Floats, triangles: NDArray[np.int64], side: int) -> Texels:
    """The texels whose centres lie in a triangle; the last triangle wins."""
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
