"""A k-d tree as flat arrays for use in compiled kernels.

Each node splits the longest side of its box at the median (Friedman, Bentley and Finkel 1977).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tts2face.numeric.kernels import kernel

MAX_LEAF_SIZE = 32  # points in a leaf; run times for 16 to 96 agree within 10 %


@dataclass(frozen=True, slots=True, eq=False)
class KdTree:
    """Points in M nodes; node i has the children 2 i + 1 and 2 i + 2.

    Parameters
    ----------
    places : (N, p)
        Points in the order of the leaves.
    order : (N,)
        Original index of each point.
    spans : (M, 2)
        Half-open range of the points of each node.
    axes, cuts : (M,)
        Axis and value at which each node splits; the axis of a leaf is -1.
    """

    places: NDArray[np.float32]
    order: NDArray[np.int32]
    spans: NDArray[np.int32]
    axes: NDArray[np.int32]
    cuts: NDArray[np.float32]


def count_nodes(n_points: int) -> int:
    """Number of nodes of the tree of a number of points."""
    n_levels = max(0, int(np.ceil(np.log2(max(n_points / MAX_LEAF_SIZE, 1.0)))))
    return int(2 ** (n_levels + 1) - 1)


def build_tree(places: NDArray[np.float32]) -> KdTree:
    """Build the tree of (N, p) points, N at least 1. O(N log N) time, O(N p) memory."""
    n_nodes = count_nodes(len(places))
    order = np.arange(len(places), dtype=np.int32)
    spans = np.zeros((n_nodes, 2), np.int32)
    axes, cuts = np.full(n_nodes, -1, np.int32), np.zeros(n_nodes, np.float32)
    spans[0] = 0, len(places)
    _split_nodes(np.ascontiguousarray(places), order, spans, axes, cuts)
    return KdTree(np.ascontiguousarray(places[order]), order, spans, axes, cuts)


@kernel
def _split_nodes(places, order, spans, axes, cuts):  # type: ignore[no-untyped-def]
    """Split all inner nodes and reorder the points."""
    for node in range(len(axes) // 2):
        low, high = spans[node]
        axis = _longest_axis(places, order, low, high)
        middle = low + (high - low) // 2
        _partition(places, order, axis, (low, high - 1, middle))
        axes[node], cuts[node] = axis, places[order[middle], axis]
        spans[2 * node + 1, 0], spans[2 * node + 1, 1] = low, middle
        spans[2 * node + 2, 0], spans[2 * node + 2, 1] = middle, high


@kernel
def _longest_axis(places, order, low, high):  # type: ignore[no-untyped-def]
    """Axis with the largest range of the points low ... high - 1."""
    best, widest = 0, np.float32(-1.0)
    for axis in range(places.shape[1]):
        least = most = places[order[low], axis]
        for i in range(low + 1, high):
            value = places[order[i], axis]
            least, most = min(least, value), max(most, value)
        if most - least > widest:
            best, widest = axis, most - least
    return best


@kernel
def _partition(places, order, axis, wanted):  # type: ignore[no-untyped-def]
    """Reorder so that no value before the middle is larger and none after it smaller (Hoare 1961)."""
    low, high, middle = wanted
    while low < high:
        pivot = places[order[(low + high) // 2], axis]
        i, j = low, high
        # equal values are exchanged, too: many equal ones would else make one side empty
        while i <= j:
            while places[order[i], axis] < pivot:
                i += 1
            while places[order[j], axis] > pivot:
                j -= 1
            if i <= j:
                order[i], order[j] = order[j], order[i]
                i, j = i + 1, j - 1
        if middle <= j:
            high = j
        elif middle >= i:
            low = i
        else:
            return
