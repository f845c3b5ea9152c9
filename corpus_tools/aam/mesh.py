"""The triangles of a talker's face in pictures: between the landmarks, between the inner lips, and around the face."""

import numpy as np
from numpy.typing import NDArray

from tts2face.models.landmarks import FACE_OVAL, INNER_LIP_LOWER, INNER_LIP_UPPER

N_MESH_LANDMARKS = 468  # the iris points behind them lie on the eyeballs
RING_SCALE = 1.35  # the ring around the face, of the oval about its middle: the skin that gives way to the chin
MOUTH_LANDMARKS = (*INNER_LIP_UPPER, *INNER_LIP_LOWER[-2:0:-1])  # once around the inner lips


def face_triangles(shape: NDArray[np.floating]) -> NDArray[np.int32]:
    """(F, 3) triangles of the face but for the inside of the mouth: Delaunay's on (468, 2) points, lips apart."""
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
    lower = [0, *range(2 * n - 3, n - 1, -1), n - 1]  # places of the lower lip's points in MOUTH_POINTS
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
    """(P,) whether each of (P, 2) places lies within a polygon (N, 2), by counting the edges to its right."""
    x, y = places[:, 0, None], places[:, 1, None]
    (ax, ay), (bx, by) = polygon.T, np.roll(polygon, -1, axis=0).T
    spans = (ay > y) != (by > y)
    with np.errstate(divide="ignore", invalid="ignore"):
        crossing = ax + (y - ay) * (bx - ax) / (by - ay)
    counts: NDArray[np.int64] = (spans & (x < crossing)).sum(axis=1)
    odd: NDArray[np.bool_] = counts % 2 == 1
    return odd
