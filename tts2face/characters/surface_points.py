"""Points on the surface of a mesh: under pixels of a view, and nearest to given positions."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from tts2face.render.camera import CameraMatrices

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

# A ray that passes a vertex at up to 3 mm, at least 12 mm before its hit, hits the vertex: it passed an outline; at up
# to 10 mm where the hit is 30 mm behind, as the neck is behind the chin.
GRAZES = ((3.0, 12.0), (10.0, 30.0))
N_NEAREST = 12  # vertices whose triangles are searched for the nearest point


@dataclass(frozen=True, slots=True, eq=False)
class SurfacePoints:
    """N points of a mesh: vertices (N, 3) and their barycentric weights (N, 3)."""

    vertices: IntArray
    weights: FloatArray

    def places(self, positions: NDArray[np.floating]) -> FloatArray:
        """Positions (N, 3) of the points on a mesh with vertices (V, 3)."""
        placed: FloatArray = np.einsum("nk,nkd->nd", self.weights, positions[self.vertices].astype(np.float64))
        return placed


def points_under_pixels(
    pixels: FloatArray, positions: FloatArray, triangles: IntArray, camera: CameraMatrices
) -> tuple[SurfacePoints, FloatArray]:
    """Points of a mesh that a camera sees at pixels (N, 2), and cosines (N,) between the rays and the surface normals.

    Triangles that face away are ignored. A ray that misses the mesh, or that passes close to an outline and hits a
    surface far behind it, gives the nearest vertex in the picture and 1; a ray that misses everything 0.
    """
    there = positions @ camera.view[:, :3].T + camera.view[:, 3]
    focal, middle_x, middle_y, _ = camera.lens
    flat = there[:, :2] / np.maximum(there[:, 2:], 1e-6) * focal + [middle_x, middle_y]
    a, b, c = (flat[triangles[:, corner]] for corner in range(3))
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    facing = np.flatnonzero(area < -1e-9)  # y points down, so counter-clockwise triangles have negative area
    corners = np.stack([a[facing], b[facing], c[facing]], axis=1)
    low, high, depth = corners.min(axis=1), corners.max(axis=1), there[triangles[facing], 2]
    seen = np.unique(triangles[facing])
    points = SurfacePoints(np.zeros((len(pixels), 3), np.int64), np.zeros((len(pixels), 3)))
    cosines = np.zeros(len(pixels))
    for number, pixel in enumerate(pixels):
        under = np.flatnonzero(((low <= pixel) & (pixel <= high)).all(axis=1))
        mixed = _barycentric(pixel, corners[under])
        inside = (mixed >= -1e-6).all(axis=1)
        hits, mixed = under[inside], mixed[inside]
        near = int((mixed * depth[hits]).sum(axis=1).argmin()) if len(hits) else -1
        hit_depth = float((mixed[near] * depth[hits[near]]).sum()) if len(hits) else np.inf
        off = np.linalg.norm(flat[seen] - pixel, axis=1)
        ahead = hit_depth - there[seen, 2]
        grazed = np.isinf(ahead)
        for reach, depth_mm in GRAZES:
            grazed |= (ahead >= depth_mm) & (off * there[seen, 2] < reach * focal)
        if grazed.any():
            vertex = int(np.where(grazed, off, np.inf).argmin())
            points.vertices[number], points.weights[number] = seen[vertex], (1.0, 0.0, 0.0)
            cosines[number] = float(len(hits) > 0)
        elif len(hits):
            corner = triangles[facing[hits[near]]]
            points.vertices[number], points.weights[number] = corner, mixed[near]
            cosines[number] = _facing(there[corner])
    return points, cosines


def nearest_points(places: FloatArray, positions: FloatArray, triangles: IntArray) -> SurfacePoints:
    """Points of a mesh nearest to places (N, 3), among the triangles around the nearest vertices."""
    used = np.unique(triangles)
    count = min(N_NEAREST, len(used))
    _, near = cKDTree(positions[used]).query(places, k=count)
    found = SurfacePoints(np.zeros((len(places), 3), np.int64), np.zeros((len(places), 3)))
    order = np.argsort(triangles.reshape(-1), kind="stable")
    starts = np.searchsorted(triangles.reshape(-1)[order], np.arange(len(positions) + 1))
    for number, place in enumerate(places):
        vertices = used[np.atleast_1d(near[number])]
        around = np.unique(np.concatenate([order[starts[v] : starts[v + 1]] // 3 for v in vertices]))
        corners = positions[triangles[around]]
        weights = _nearest_weights(place, corners)
        gaps = np.linalg.norm(np.einsum("fk,fkd->fd", weights, corners) - place, axis=1)
        best = int(gaps.argmin())
        found.vertices[number], found.weights[number] = triangles[around[best]], weights[best]
    return found


def _facing(corners: FloatArray) -> float:
    """Cosine between the ray to a triangle (3, 3) in camera space and the normal of the triangle."""
    normal, middle = np.cross(corners[1] - corners[0], corners[2] - corners[0]), corners.mean(axis=0)
    length = float(np.linalg.norm(normal) * np.linalg.norm(middle))
    return abs(float(normal @ middle)) / max(length, 1e-30)


def _barycentric(pixel: FloatArray, corners: FloatArray) -> FloatArray:
    """Barycentric weights (F, 3) of a pixel in projected triangles (F, 3, 2)."""
    one, two, there = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0], pixel - corners[:, 0]
    area = one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]
    area = np.where(np.abs(area) < 1e-12, np.inf, area)
    second = (there[:, 0] * two[:, 1] - there[:, 1] * two[:, 0]) / area
    third = (one[:, 0] * there[:, 1] - one[:, 1] * there[:, 0]) / area
    return np.stack([1.0 - second - third, second, third], axis=1)


def _nearest_weights(place: FloatArray, corners: FloatArray) -> FloatArray:
    """Barycentric weights (F, 3) of the points of triangles (F, 3, 3) nearest to a place.

    Source: Ericson 2005, Real-Time Collision Detection, section 5.1.5.
    """
    one, two, there = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0], place - corners[:, 0]
    d11, d12, d22 = (one * one).sum(axis=1), (one * two).sum(axis=1), (two * two).sum(axis=1)
    d1, d2 = (there * one).sum(axis=1), (there * two).sum(axis=1)
    area = np.maximum(d11 * d22 - d12 * d12, 1e-30)
    second, third = (d22 * d1 - d12 * d2) / area, (d11 * d2 - d12 * d1) / area
    inner = np.stack([1.0 - second - third, second, third], axis=1)
    candidates = [np.where((inner >= 0).all(axis=1)[:, None], inner, np.nan)]
    for first, last in ((0, 1), (1, 2), (2, 0)):
        along = corners[:, last] - corners[:, first]
        length = np.maximum((along**2).sum(axis=1), 1e-30)
        share = np.clip(((place - corners[:, first]) * along).sum(axis=1) / length, 0.0, 1.0)
        weights = np.zeros((len(corners), 3))
        weights[:, first], weights[:, last] = 1.0 - share, share
        candidates.append(weights)
    stacked = np.stack(candidates)
    gaps = np.linalg.norm(np.einsum("cfk,fkd->cfd", stacked, corners) - place, axis=2)
    best = np.where(np.isnan(gaps), np.inf, gaps).argmin(axis=0)
    nearest: FloatArray = stacked[best, np.arange(len(corners))]
    return nearest
