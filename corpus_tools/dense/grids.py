"""Triangles of surfaces that are stored row by row, and the side to which closed ones face."""

import numpy as np
from numpy.typing import NDArray

from tts2face.numeric.arrays import FloatArray, IntArray


def grid_triangles(n_rows: int, n_columns: int, *, is_closed: bool = False) -> NDArray[np.int64]:
    """(F, 3) triangles of a surface stored row by row; a closed one joins its last column to its first."""
    steps = n_columns if is_closed else n_columns - 1
    row, column = (grid.ravel() for grid in np.meshgrid(np.arange(n_rows - 1), np.arange(steps), indexing="ij"))
    here, beside = row * n_columns + column, row * n_columns + (column + 1) % n_columns
    return np.concatenate(
        [
            np.stack([here, beside, beside + n_columns], axis=1),
            np.stack([here, beside + n_columns, here + n_columns], axis=1),
        ]
    ).astype(np.int64)


def wind_outward(points: FloatArray, triangles: IntArray, about: FloatArray | float = 0.0) -> IntArray:
    """Triangles (F, 3) of a closed surface whose normals point away from `about`."""
    a, b, c = (points[triangles] - about).transpose(1, 0, 2)
    return triangles if np.einsum("fc,fc->f", a, np.cross(b, c)).sum() > 0 else triangles[:, ::-1]
