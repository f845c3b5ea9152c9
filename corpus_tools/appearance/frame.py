"""Reference frame of a texture: points, triangles between landmarks, pixels, and warping of pictures to it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tts2face.models.landmarks import FACE_OVAL, INNER_LIP_LOWER, INNER_LIP_UPPER, N_MESH_LANDMARKS
from tts2face.numeric.arrays import FloatArray, points_in_polygon
from tts2face.picture.kernels.warps import sample_triangles

RING_SCALE = 1.35  # scale of the ring of skin around the face, relative to its oval
MOUTH_LANDMARKS = (*INNER_LIP_UPPER, *INNER_LIP_LOWER[-2:0:-1])  # in order around the inner lips
MARGIN_PX = 2.0  # between the mesh and the edge of the texture


@dataclass(frozen=True, slots=True, eq=False)
class ReferenceFrame:
    """A reference shape of N points in a texture, and where its pixels lie in the triangles.

    ``points`` (N, 2) pixels; ``triangles`` (F, 3); ``size`` (width, height); ``pixels`` (P,) as ``y * width + x``;
    pixel i lies at ``sum_k weights[i, k] points[corners[i, k]]``.
    """

    points: NDArray[np.float32]
    triangles: NDArray[np.int32]
    size: tuple[int, int]
    pixels: NDArray[np.int32]
    corners: NDArray[np.int32]
    weights: NDArray[np.float32]

    def texture(self, picture: NDArray[np.uint8], points: NDArray[np.floating]) -> NDArray[np.float32]:
        """(P, 3) texture of an (H, W, 3) picture with landmarks (N, 2), by piecewise-affine warping."""
        texture = np.zeros((len(self.pixels), 3), np.float32)
        sample_triangles(picture, np.asarray(points, np.float64), self.corners, self.weights, texture)
        return texture


def build_reference_frame(shape: NDArray[np.floating], triangles: NDArray[np.int32], side: int) -> ReferenceFrame:
    """The frame of a reference shape (N, 2), its longer side `side` pixels long."""
    used = shape[np.unique(triangles)]
    low, high = used.min(axis=0), used.max(axis=0)
    scale = (side - 1 - 2 * MARGIN_PX) / (high - low).max()
    points = (np.asarray(shape, np.float64) - low) * scale + MARGIN_PX
    width, height = (int(np.ceil(length)) for length in (high - low) * scale + 2 * MARGIN_PX + 1)
    owner, weights = rasterise_triangles(points, triangles, (width, height))
    pixels = np.flatnonzero(owner >= 0)
    return ReferenceFrame(
        points.astype(np.float32),
        triangles.astype(np.int32),
        (width, height),
        pixels.astype(np.int32),
        triangles[owner[pixels]].astype(np.int32),
        weights[pixels].astype(np.float32),
    )


def rasterise_triangles(
    points: FloatArray, triangles: NDArray[np.int32], size: tuple[int, int]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Triangle over each pixel (-1: none) and the pixel's barycentric coordinates in it."""
    width, height = size
    owner = np.full(width * height, -1, np.int64)
    weights = np.zeros((width * height, 3))
    for number, corners in enumerate(points[triangles]):
        low = np.maximum(np.floor(corners.min(axis=0)).astype(int), 0)
        high = np.minimum(np.ceil(corners.max(axis=0)).astype(int), (width - 1, height - 1))
        x, y = np.meshgrid(np.arange(low[0], high[0] + 1), np.arange(low[1], high[1] + 1))
        inside = barycentric_coordinates(np.stack([x.ravel(), y.ravel()], axis=1), corners)
        hit = (inside >= -1e-9).all(axis=1)
        at = y.ravel()[hit] * width + x.ravel()[hit]
        owner[at], weights[at] = number, np.clip(inside[hit], 0.0, 1.0)
    return owner, weights


def barycentric_coordinates(places: NDArray[np.floating], corners: FloatArray) -> FloatArray:
    """(P, 3) barycentric coordinates of (P, 2) places in a triangle (3, 2); a degenerate triangle contains no point."""
    a, b, c = corners
    across, along, off = b - a, c - a, places - a
    area = across[0] * along[1] - across[1] * along[0]
    if area == 0.0:
        # no place lies inside a triangle without an area
        return np.full((len(places), 3), -1.0)
    second = (off[:, 0] * along[1] - off[:, 1] * along[0]) / area
    third = (across[0] * off[:, 1] - across[1] * off[:, 0]) / area
    return np.stack([1.0 - second - third, second, third], axis=1)


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
