"""Cutting of triangles along a plane, so that the edge of a crop is straight."""

from dataclasses import dataclass

import numpy as np

from tts2face.numeric.arrays import FloatArray, IntArray


@dataclass(frozen=True, slots=True, eq=False)
class Cut:
    """Part of a mesh above a plane.

    Parameters
    ----------
    upper, lower, share : (E,)
        Ends of each cut edge, above and below the plane, and the share of the way from the upper to the lower end at
        which the plane lies. The points there are the vertices from V on.
    triangles : (F, 3)
        Triangles above the plane in their order, then the parts of divided ones.
    source : (F,)
        Index of the triangle that each comes from.
    """

    upper: IntArray
    lower: IntArray
    share: FloatArray
    triangles: IntArray
    source: IntArray


def cut_triangles(triangles: IntArray, heights: FloatArray) -> Cut:
    """Part of triangles (F, 3) where the heights (V,) of their vertices above a plane are not negative."""
    above = heights >= 0
    is_above = above[triangles]
    n_above = is_above.sum(axis=1)
    # triangles across the plane: one corner is alone on its side
    rows = np.flatnonzero((n_above > 0) & (n_above < 3))
    odd = np.where(n_above[rows] == 1, is_above[rows].argmax(axis=1), is_above[rows].argmin(axis=1))
    alone, after, before = (triangles[rows, (odd + step) % 3] for step in range(3))
    pairs = np.concatenate([np.column_stack([alone, after]), np.column_stack([alone, before])])
    pairs = np.where(above[pairs[:, :1]], pairs, pairs[:, ::-1])
    edges, places = np.unique(pairs, axis=0, return_inverse=True)
    upper, lower = edges.T
    to_after, to_before = places.reshape(2, -1) + len(heights)
    tip, base = n_above[rows] == 1, n_above[rows] == 2
    divided = [
        np.column_stack([alone, to_after, to_before])[tip],
        np.column_stack([to_after, after, before])[base],
        np.column_stack([to_after, before, to_before])[base],
    ]
    kept = np.flatnonzero(n_above == 3)
    return Cut(
        upper,
        lower,
        heights[upper] / (heights[upper] - heights[lower]),
        np.concatenate([triangles[kept], *divided]),
        np.concatenate([kept, rows[tip], rows[base], rows[base]]),
    )
