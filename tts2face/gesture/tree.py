"""A k-d tree over many windows in few dimensions, as flat arrays that compiled loops can walk.

After Friedman, Bentley and Finkel 1977: each node splits the longest side of its box at the median.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

LEAF = 16  # places in a leaf; 8 and 32 are as fast within a tenth


@dataclass(frozen=True, slots=True, eq=False)
class Tree:
    """Places in nodes; node i has the children 2 i + 1 and 2 i + 2.

    Parameters
    ----------
    places : (N, p)
        In the order of the leaves.
    order : (N,)
        Which of the given places each one is.
    spans : (M, 2)
        First place of each node and one past its last.
    axes, cuts : (M,)
        Where each node splits; the axis of a leaf is -1.
    """

    places: NDArray[np.float32]
    order: NDArray[np.int32]
    spans: NDArray[np.int32]
    axes: NDArray[np.int32]
    cuts: NDArray[np.float32]


def tree_of(places: NDArray[np.float32]) -> Tree:
    """The tree of (N, p) places, N at least 1. O(N log N) time, O(N p) memory."""
    n_places = len(places)
    n_levels = max(0, int(np.ceil(np.log2(max(n_places / LEAF, 1.0)))))
    n_nodes = 2 ** (n_levels + 1) - 1
    order = np.arange(n_places, dtype=np.int32)
    spans = np.zeros((n_nodes, 2), np.int32)
    axes, cuts = np.full(n_nodes, -1, np.int32), np.zeros(n_nodes, np.float32)
    spans[0] = 0, n_places
    for node in range(2**n_levels - 1):
        low, high = spans[node]
        here = places[order[low:high]]
        axis = int(np.argmax(here.max(axis=0) - here.min(axis=0)))
        middle = (high - low) // 2
        sorted_rows = np.argpartition(here[:, axis], middle)
        order[low:high] = order[low:high][sorted_rows]
        axes[node], cuts[node] = axis, here[sorted_rows[middle], axis]
        spans[2 * node + 1], spans[2 * node + 2] = (low, low + middle), (low + middle, high)
    return Tree(np.ascontiguousarray(places[order]), order, spans, axes, cuts)
