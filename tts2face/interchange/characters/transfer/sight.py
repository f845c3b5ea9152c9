"""View of a head from straight ahead: the foremost triangle of each cell of a grid."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tts2face.numeric.arrays import FloatArray, IntArray, Mask

STEP_MM = 0.25  # side of a cell
DENSITY = 0.6  # of a cell: distance of the samples of a triangle


@dataclass(frozen=True, slots=True, eq=False)
class Sight:
    """Grid of cells before a head.

    Parameters
    ----------
    low : (2,)
        x and y of the corner of the first cell, mm.
    step
        Side of a cell, mm.
    depth, triangle : (X, Y)
        z of the foremost surface in each cell, -inf and -1 where there is none.
    """

    low: FloatArray
    step: float
    depth: FloatArray
    triangle: IntArray

    def heights(self, is_shown: Mask) -> FloatArray:
        """(X,) millimetres of each column in which a triangle (F,) of these is seen."""
        seen = np.append(is_shown, False)[self.triangle]
        heights: FloatArray = seen.sum(axis=1) * self.step
        return heights


def view_ahead(
    places: FloatArray, triangles: NDArray[np.integer], box: tuple[FloatArray, FloatArray], step: float = STEP_MM
) -> Sight:
    """View along z of triangles (F, 3) of a mesh with vertices (V, 3), within a box of x and y."""
    low, high = (np.asarray(corner[:2], np.float64) for corner in box)
    size = np.maximum(np.ceil((high - low) / step).astype(np.int64), 1)
    depth, owner = np.full(int(size.prod()), -np.inf), np.full(int(size.prod()), -1, np.int64)
    flat = places[:, :2][triangles]
    inside = np.flatnonzero(((flat.max(axis=1) > low) & (flat.min(axis=1) < high)).all(axis=1))
    longest = np.linalg.norm(flat[inside] - np.roll(flat[inside], 1, axis=1), axis=2).max(axis=1, initial=0.0)
    counts = np.ceil(longest / (DENSITY * step)).astype(np.int64) + 1
    for count in np.unique(counts).tolist():
        first, second = np.meshgrid(np.arange(count + 1), np.arange(count + 1), indexing="ij")
        kept = first + second <= count
        weights = np.column_stack([first[kept], second[kept], count - first[kept] - second[kept]]) / count
        rows = inside[counts == count]
        samples = np.einsum("sk,fkd->fsd", weights, places[triangles[rows]]).reshape(-1, 3)
        cells = np.floor((samples[:, :2] - low) / step).astype(np.int64)
        ok = ((cells >= 0) & (cells < size)).all(axis=1)
        at, z = cells[ok, 0] * size[1] + cells[ok, 1], samples[ok, 2]
        of = np.repeat(rows, len(weights))[ok]
        order = np.argsort(z, kind="stable")
        last = np.full(len(depth), -1, np.int64)
        last[at[order]] = order  # the last written, which is the foremost, stays
        hit = np.flatnonzero(last >= 0)
        hit = hit[z[last[hit]] > depth[hit]]
        depth[hit], owner[hit] = z[last[hit]], of[last[hit]]
    return Sight(low, step, depth.reshape(size), owner.reshape(size))
