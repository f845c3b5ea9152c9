"""Wires of glasses: tubes along a path."""

import numpy as np
from numpy.typing import NDArray

from corpus_tools.dense.grids import grid_triangles, wind_outward
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
    points = rings.reshape(-1, 3)
    return points, wind_outward(points, grid_triangles(len(rings), N_SECTION + 1), path.mean(axis=0))
