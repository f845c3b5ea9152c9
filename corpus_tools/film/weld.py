"""Vertices that lie at one place and move alike are one in the path tracer."""

import numpy as np
from numpy.typing import NDArray

from tts2face.models.face import Face

Ints = NDArray[np.int64]


def weld_vertices(face: Face) -> tuple[Ints, Ints]:
    """First vertex (W,) of each group at one place that moves alike, and the group (V,) of each vertex."""
    weights = np.cos(np.arange(1, len(face.shape_names) + 1))  # arbitrary ones that separate different motions
    mixed = np.einsum("k,kvc->vc", weights, face.shapes.astype(np.float64))
    keys = np.rint(1000 * np.column_stack([face.vertices, mixed])).astype(np.int64)
    _, first, group = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    return first, group.ravel()
