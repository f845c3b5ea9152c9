"""Triangles of a face in pictures: between the landmarks, between the inner lips, and around the face."""

import numpy as np
from numpy.typing import NDArray

from tts2face.models.landmarks import FACE_OVAL, INNER_LIP_LOWER, INNER_LIP_UPPER

N_MESH_LANDMARKS = 468  # the iris landmarks after them lie on the eyeballs
RING_SCALE = 1.35  # scale of the ring of skin around the face, relative to its oval
MOUTH_LANDMARKS = (*INNER_LIP_UPPER, *INNER_LIP_LOWER[-2:0:-1])  # in order around the inner lips


def face_triangles(shape: NDArray[np.floating]) -> NDArray[np.int32]:
    """(F, 3) Delaunay triangles of (468, 2) points with open lips, without the inside of the mouth."""
    from scipy.spatial import Delaunay

    triangles = np.asarray(Delaunay(shape[:N_MESH_LANDMARKS]).simplices)
    middles = shape[triangles].mean(axis=1)
    kept = points_in_polygon(middles, shape[list(FACE_OVAL)]) & ~points_in_polygon(
        middles, shape[list(MOUTH_LANDMARKS)]
    )
    return np.asarray(triangles[kept], np.int32)


def mouth_triangles() -> NDArray[np.int32]:
    """(G, 3) triangles between the inner lips, of `MOUTH_LANDMARKS`: a strip from corner to corner."""
    n = len(INNER_LIP_UPPER)
    lower = [0, *range(2 * n - 3, n - 1, -1), n - 1]  # indices of the lower lip in MOUTH_LANDMARKS
    rows = []
    for k in range(n - 1):
        rows += [(k, k + 1, lower[k + 1]), (k, lower[k + 1], lower[k])]
    return np.array([row for row in rows if len(set(row)) == 3], np.int32)


def face_ring(points: NDArray[np.floating]) -> NDArray[np.float64]:
    """(..., 36, 2) points around the face, of (..., N, 2) landmarks."""
    oval = np.asarray(points[..., list(FACE_OVAL), :], np.float64)
    middle = oval.mean(axis=-2, keepdims=True)
    return np.asarray(middle + RING_SCALE * (oval - middle))


def points_in_polygon(places: NDArray[np.floating], polygon: NDArray[np.floating]) -> NDArray[np.bool_]:
    """(P,) whether points (P, 2) are inside a polygon (N, 2), by counting the edges to their right."""
    x, y = places[:, 0, None], places[:, 1, None]
    (ax, ay), (bx, by) = polygon.T, np.roll(polygon, -1, axis=0).T
    spans = (ay > y) != (by > y)
    with np.errstate(divide="ignore", invalid="ignore"):
        crossing = ax + (y - ay) * (bx - ax) / (by - ay)
    counts: NDArray[np.int64] = (spans & (x < crossing)).sum(axis=1)
    odd: NDArray[np.bool_] = counts % 2 == 1
    return odd
