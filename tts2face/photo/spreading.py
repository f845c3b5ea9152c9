"""Displacements of a mesh that are known at some vertices, spread smoothly over the others."""

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from tts2face.numeric.arrays import FloatArray, IntArray

LEAST_LENGTH = 0.004  # of an edge, of the size of the face: shorter ones weigh no more
RIDGE = 1e-9  # so that pieces of the mesh where nothing is known have a solution


class Spreading:
    """Smooth displacements over a mesh: least squares of its Laplacian, weighted by the inverse lengths of edges.

    Parameters
    ----------
    places : (V, 2)
        Vertices, pixels.
    triangles : (F, 3)
    scale
        Size of the face, pixels.

    Notes
    -----
    Source: Sorkine et al. 2004, Laplacian surface editing.
    """

    def __init__(self, places: FloatArray, triangles: IntArray, scale: float) -> None:
        edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
        edges = np.unique(np.sort(edges, axis=1), axis=0)
        lengths = np.linalg.norm(places[edges[:, 0]] - places[edges[:, 1]], axis=1) / scale
        weights = 1 / np.maximum(lengths, LEAST_LENGTH)
        n = len(places)
        both = (np.concatenate([weights, weights]), (edges.T.ravel(), edges[:, ::-1].T.ravel()))
        near = sparse.coo_matrix(both, shape=(n, n)).tocsr()
        total = np.asarray(near.sum(axis=1)).ravel()
        total[total == 0] = 1
        laplacian = sparse.eye(n) - sparse.diags(1 / total) @ near
        self._n = n
        self._bending = (laplacian.T @ laplacian).tocsr()

    def exact(self, vertices: IntArray, values: FloatArray) -> FloatArray:
        """(V, ...) values that are those given (N, ...) at vertices (N,)."""
        n = self._n
        found = np.zeros((n, values[0].size))
        found[vertices] = values.reshape(len(vertices), -1)
        free = np.setdiff1d(np.arange(n), vertices)
        system = self._bending[free]
        inside = (system[:, free] + RIDGE * sparse.eye(len(free))).tocsc()
        found[free] = _solved(inside, -(system[:, vertices] @ found[vertices]))
        return found.reshape(n, *values.shape[1:])

    def near(
        self, vertices: IntArray, values: FloatArray, weights: FloatArray, still: IntArray | None = None
    ) -> FloatArray:
        """(V, ...) values near those given (N, ...) at vertices (N,), by weights (N,); 0 at those that are still."""
        n = self._n
        pull, wanted = np.zeros(n), np.zeros((n, values[0].size))
        pull[vertices] = weights
        wanted[vertices] = values.reshape(len(vertices), -1)
        free = np.setdiff1d(np.arange(n), [] if still is None else still)
        system = (self._bending[free][:, free] + sparse.diags(pull[free] + RIDGE)).tocsc()
        found = np.zeros_like(wanted)
        found[free] = _solved(system, pull[free, None] * wanted[free])
        return found.reshape(n, *values.shape[1:])


def _solved(system: sparse.csc_matrix, values: FloatArray) -> FloatArray:
    """Solution (N, K) of a symmetric system, whose own order keeps its factors sparse, for values (N, K).

    One column after the other: all at once go through a threaded BLAS, which takes eight times as long.
    """
    factors = splu(system, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    return np.array([factors.solve(column) for column in np.ascontiguousarray(values.T)]).T
