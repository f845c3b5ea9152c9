"""Catmull-Clark subdivision of a quad mesh as a matrix, which also applies to shapes and texture coordinates."""

from collections.abc import Iterable, Sequence
from itertools import accumulate

import numpy as np
from numpy.typing import NDArray
from scipy import sparse


def catmull_clark(n_vertices: int, quads: NDArray[np.integer]) -> tuple[sparse.csr_array, NDArray[np.int64]]:
    """One step: new points = matrix @ points.

    Parameters
    ----------
    quads : (F, 4)
        Every vertex belongs to at least one.

    Returns
    -------
    matrix : (V + E + F, V)
        Rows: old vertices, then edges, then faces; each sums to 1.
    quads : (4 F, 4)
        Quad ``4 f + k`` holds corner k of face f as its first corner.

    Notes
    -----
    On the border a vertex and its edges follow the cubic B-spline of the border alone. Source: Catmull and Clark 1978.
    """
    n_faces = len(quads)
    edges, edge_of = _edges(quads)
    n_edges = len(edges)
    face_of = np.repeat(np.arange(n_faces), 4)
    face_points = _averages(face_of, quads.ravel(), (n_faces, n_vertices))
    midpoints = _averages(np.repeat(np.arange(n_edges), 2), edges.ravel(), (n_edges, n_vertices))
    beside = _averages(edge_of, face_of, (n_edges, n_faces)) @ face_points
    is_inner = np.bincount(edge_of, minlength=n_edges) == 2
    edge_points = _scale_rows(np.where(is_inner, 0.5, 1.0), midpoints) + _scale_rows(
        np.where(is_inner, 0.5, 0.0), beside
    )
    rim = edges[~is_inner]
    on_rim = np.zeros(n_vertices, bool)
    on_rim[rim] = True
    valence = np.bincount(edges.ravel(), minlength=n_vertices).astype(float)
    same = sparse.eye_array(n_vertices, format="csr")
    faces_around = _averages(quads.ravel(), face_of, (n_vertices, n_faces)) @ face_points
    edges_around = _averages(edges.ravel(), np.repeat(np.arange(n_edges), 2), (n_vertices, n_edges)) @ midpoints
    inner = _scale_rows(~on_rim / valence, faces_around + 2.0 * edges_around) + _scale_rows(
        ~on_rim * (1 - 3 / valence), same
    )
    along = sparse.csr_array((np.full(2 * len(rim), 0.125), (rim.ravel(), rim[:, ::-1].ravel())), shape=same.shape)
    matrix = sparse.vstack([inner + _scale_rows(0.75 * on_rim, same) + along, edge_points, face_points], format="csr")
    edge_at = n_vertices + edge_of.reshape(-1, 4)  # of side k, from corner k to k + 1
    centre = n_vertices + n_edges + np.arange(n_faces)
    new = [np.stack([quads[:, k], edge_at[:, k], centre, edge_at[:, k - 1]], axis=1) for k in range(4)]
    return matrix, np.stack(new, axis=1).reshape(-1, 4).astype(np.int64)


def triangulate(quads: NDArray[np.integer]) -> NDArray[np.int64]:
    """(2 F, 3) triangles of (F, 4) quads, with the same winding."""
    return np.stack([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]], axis=1).reshape(-1, 3).astype(np.int64)


def join_triangles(triangles: Sequence[NDArray[np.int64]], n_points: Iterable[int]) -> NDArray[np.int64]:
    """(F, 3) triangles of pieces, one after the other, over the joined points of all; `n_points` is of each piece."""
    firsts = accumulate(n_points, initial=0)  # one more than there are pieces
    return np.concatenate([own + first for own, first in zip(triangles, firsts, strict=False)])


def _edges(quads: NDArray[np.integer]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Edges (E, 2) and the edge of each side of each quad (4 F,)."""
    sides = np.stack([quads, np.roll(quads, -1, axis=1)], axis=-1).reshape(-1, 2)
    edges, edge_of = np.unique(np.sort(sides, axis=1), axis=0, return_inverse=True)
    return edges.astype(np.int64), edge_of.ravel()


def _averages(rows: NDArray[np.integer], columns: NDArray[np.integer], shape: tuple[int, int]) -> sparse.csr_array:
    """Matrix whose rows average their columns."""
    counts = np.bincount(rows, minlength=shape[0])
    return sparse.csr_array((1.0 / counts[rows], (rows, columns)), shape=shape)


def _scale_rows(factors: NDArray[np.floating], matrix: sparse.csr_array) -> sparse.csr_array:
    scaled: sparse.csr_array = sparse.diags_array(factors.astype(float)) @ matrix
    return scaled
