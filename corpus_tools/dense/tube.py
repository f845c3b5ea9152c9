"""Wires of glasses: tubes along a path."""

import numpy as np
from numpy.typing import NDArray

from tts2face.numeric.arrays import FloatArray, unit_vectors

N_SECTION = 8
ASKEW = (0.31, 0.17, 0.93)  # along no path


def tube(path: FloatArray, radius_mm: float, *, is_closed: bool = False) -> tuple[FloatArray, NDArray[np.int64]]:
    """Points and triangles of a tube along a path (N, 3)."""
    around = np.roll(path, -1, axis=0) - np.roll(path, 1, axis=0) if is_closed else np.gradient(path, axis=0)
    along = unit_vectors(around)
    up = unit_vectors(np.cross(along, ASKEW) + 1e-9)
    side = np.cross(along, up)
    turn = np.linspace(0, 2 * np.pi, N_SECTION, endpoint=False)
    rings = path[:, None] + radius_mm * (
        np.cos(turn)[None, :, None] * up[:, None] + np.sin(turn)[None, :, None] * side[:, None]
    )
    rings = rings[:, np.append(np.arange(N_SECTION), 0)]
    if is_closed:
        rings = np.concatenate([rings, rings[:1]])
    n = N_SECTION + 1
    row, column = (grid.ravel() for grid in np.meshgrid(np.arange(len(rings) - 1), np.arange(N_SECTION), indexing="ij"))
    here = row * n + column
    halves = (here, here + 1, here + n + 1), (here, here + n + 1, here + n)
    triangles = np.concatenate([np.stack(corners, axis=1) for corners in halves]).astype(np.int64)
    points = rings.reshape(-1, 3)
    a, b, c = (points[triangles] - path.mean(axis=0)).transpose(1, 0, 2)
    is_outward = np.einsum("fc,fc->f", a, np.cross(b, c)).sum() > 0
    return points, triangles if is_outward else triangles[:, ::-1]
