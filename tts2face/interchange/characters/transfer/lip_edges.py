"""Displacements of lips that were cut apart, made smooth along their edges."""

import numpy as np
from scipy.spatial import cKDTree

from tts2face.interchange.characters.transfer.skin import Skin
from tts2face.numeric.arrays import FloatArray, IntArray

ALONG = 0.05  # of the edge's length: standard deviation of the weights of its points
REACH = 0.15  # of the same length: distance within which the lip follows what was changed at its edge
LEAST_POINTS = 6  # of an edge that is smoothed


def smooth_edges(skin: Skin, shapes: FloatArray, edges: tuple[IntArray, IntArray]) -> FloatArray:
    """Shapes (K, S, 3) that are smooth along the edges of the upper and the lower lip, vertices of the skin each."""
    changed = shapes.copy()
    for side, edge in enumerate(edges, 1):
        if len(edge) < LEAST_POINTS:
            continue
        flat = shapes[:, edge].transpose(1, 0, 2).reshape(len(edge), -1)
        x = skin.vertices[edge, 0]
        length = float(np.ptp(x))
        off = (_local_lines(x, flat, ALONG * length) - flat).reshape(len(edge), len(shapes), 3).transpose(1, 0, 2)
        lip = np.flatnonzero(skin.side == side)
        far, near = (np.asarray(found) for found in cKDTree(skin.vertices[edge]).query(skin.vertices[lip]))
        fade = np.clip(1.0 - far / (REACH * length), 0.0, 1.0)
        changed[:, lip] += fade[:, None] * off[:, near]
    return changed


def _local_lines(x: FloatArray, values: FloatArray, width: float) -> FloatArray:
    """Values (N, C) at places (N,) on lines fitted around each by Gaussian weights: ends keep their slopes."""
    x = x - x.mean()
    weights = np.exp(-0.5 * ((x[:, None] - x) / width) ** 2)
    zeroth, first, second = (weights @ x**power for power in range(3))
    spread = zeroth * second - first**2
    means, moments = weights @ values, weights @ (x[:, None] * values)
    lines = (second - x * first)[:, None] * means + (x * zeroth - first)[:, None] * moments
    fitted: FloatArray = np.where(spread[:, None] > 1e-9, lines / np.maximum(spread, 1e-9)[:, None], values)
    return fitted
