"""Points on the surface of a mesh: under pixels of a view, and nearest to given positions."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from tts2face.numeric.arrays import FloatArray, IntArray
from tts2face.picture.camera import CameraMatrices

# A ray that passes a vertex at up to 3 mm, at least 12 mm before its hit, hits the vertex: it passed an outline; at up
# to 10 mm where the hit is 30 mm behind, as the neck is behind the chin.
GRAZES = ((3.0, 12.0), (10.0, 30.0))
MAX_VERTEX_MM = 2.5  # distance from the ray up to which the vertex of an outline is taken as it is
INWARD_STEPS = np.linspace(0.01, 0.3, 30)  # shares of the way to the middle of all pixels at which a surface is sought
CELL_PX = 16.0  # side of the cells of a picture in which the triangles under a pixel are looked up
N_CELLS = 64  # cells along each side of the grid; what lies beyond it counts to the cells at its border
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

    Triangles that face away are ignored. Where a ray misses the mesh, or passes close to an outline and hits a surface
    far behind it, the point is the nearest vertex in the picture if it is near, otherwise the outline in the direction
    of the middle of all pixels; its cosine is 1 for a grazed outline, 0 for a miss.
    """
    projection = _Projection(positions, triangles, camera)
    points = SurfacePoints(np.zeros((len(pixels), 3), np.int64), np.zeros((len(pixels), 3)))
    cosines = np.zeros(len(pixels))
    middle = pixels.mean(axis=0)
    for number, pixel in enumerate(pixels):
        hit = projection.hit(pixel)
        vertex = projection.outline_vertex(pixel, np.inf if hit is None else hit.depth)
        cosines[number] = 0.0 if hit is None else 1.0 if vertex is not None else hit.facing
        # beside the outline: the surface is sought towards the middle of the face
        if vertex is not None and projection.distance(vertex, pixel) > MAX_VERTEX_MM:
            steps = (projection.hit(pixel + share * (middle - pixel)) for share in INWARD_STEPS)
            depth = projection.depth(vertex) + GRAZES[0][1]
            hit = next((inner for inner in steps if inner is not None and inner.depth < depth), None)
            vertex = vertex if hit is None else None
        if vertex is not None:
            points.vertices[number], points.weights[number] = vertex, (1.0, 0.0, 0.0)
        elif hit is not None:
            points.vertices[number], points.weights[number] = hit.corners, hit.weights
    return points, cosines


@dataclass(frozen=True, slots=True, eq=False)
class _Hit:
    """Point of a triangle under a pixel: vertices (3,), barycentric weights (3,), depth in mm, cosine to the ray."""

    corners: IntArray
    weights: FloatArray
    depth: float
    facing: float


class _Projection:
    """Mesh projected into a picture."""

    def __init__(self, positions: FloatArray, triangles: IntArray, camera: CameraMatrices) -> None:
        self._there = positions @ camera.view[:, :3].T + camera.view[:, 3]
        focal, middle_x, middle_y, _ = camera.lens
        self._focal = float(focal)
        self._flat = self._there[:, :2] / np.maximum(self._there[:, 2:], 1e-6) * focal + [middle_x, middle_y]
        a, b, c = (self._flat[triangles[:, corner]] for corner in range(3))
        area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
        # back faces are not under a pixel
        is_facing = area < -1e-9  # y points down, so counter-clockwise triangles have negative area
        self._triangles = triangles[is_facing] if is_facing.any() else triangles
        self._corners = self._flat[self._triangles]
        self._left, self._top = np.ascontiguousarray(self._corners.min(axis=1).T)
        self._right, self._bottom = np.ascontiguousarray(self._corners.max(axis=1).T)
        self._starts, self._members = _sort_into_cells(
            np.column_stack([self._left, self._top]), np.column_stack([self._right, self._bottom])
        )
        is_seen = np.zeros(len(positions), bool)
        is_seen[self._triangles] = True
        self._seen = np.flatnonzero(is_seen)
        self._tree = cKDTree(self._flat[self._seen])
        nearest = float(np.maximum(self._there[self._seen, 2].min(), 1.0))
        self._reach_px = GRAZES[-1][0] * self._focal / nearest

    def hit(self, pixel: FloatArray) -> _Hit | None:
        """Nearest triangle under a pixel."""
        x, y = pixel
        column, row = _cells(pixel)
        near = self._members[slice(*self._starts[row * N_CELLS + column : row * N_CELLS + column + 2])]
        is_around = (self._left[near] <= x) & (x <= self._right[near])
        under = near[is_around & (self._top[near] <= y) & (y <= self._bottom[near])]
        mixed = _barycentric(pixel, self._corners[under])
        inside = (mixed >= -1e-6).all(axis=1)
        hits, mixed = under[inside], mixed[inside]
        if not len(hits):
            return None
        depths = (mixed * self._there[self._triangles[hits], 2]).sum(axis=1)
        first = int(depths.argmin())
        corners = self._triangles[hits[first]]
        return _Hit(corners, mixed[first], float(depths[first]), _facing(self._there[corners]))

    def outline_vertex(self, pixel: FloatArray, depth: float) -> int | None:
        """Vertex of an outline that a ray with a hit at a depth (infinite without one) passes; None if it does not."""
        if np.isinf(depth):
            return int(self._seen[int(np.asarray(self._tree.query(pixel)[1]))])
        near = self._seen[np.array(self._tree.query_ball_point(pixel, self._reach_px), np.int64)]
        off = np.linalg.norm(self._flat[near] - pixel, axis=1)
        ahead, grazed = depth - self._there[near, 2], np.zeros(len(near), bool)
        for reach, depth_mm in GRAZES:
            grazed |= (ahead >= depth_mm) & (off * self._there[near, 2] < reach * self._focal)
        return int(near[np.where(grazed, off, np.inf).argmin()]) if grazed.any() else None

    def distance(self, vertex: int, pixel: FloatArray) -> float:
        """Distance in mm, across the line of sight, of a vertex from a pixel."""
        return float(np.linalg.norm(self._flat[vertex] - pixel) * self.depth(vertex) / self._focal)

    def depth(self, vertex: int) -> float:
        """Depth of a vertex, mm."""
        return float(self._there[vertex, 2])


def _cells(pixels: FloatArray) -> IntArray:
    """Column and row of the cells of pixels (N, 2) or (2,)."""
    cells: IntArray = np.clip(pixels / CELL_PX, 0, N_CELLS - 1).astype(np.int64)
    return cells


def _sort_into_cells(low: FloatArray, high: FloatArray) -> tuple[IntArray, IntArray]:
    """Boxes from `low` to `high`, (F, 2) each, by the cells that they touch.

    Cell c has the boxes ``members[starts[c]:starts[c + 1]]`` in their order.
    """
    first, last = _cells(low), _cells(high)
    across, down = (last - first + 1).T
    counts = across * down
    box = np.repeat(np.arange(len(low)), counts)
    step = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    cell = (first[box, 1] + step // across[box]) * N_CELLS + first[box, 0] + step % across[box]
    order = np.argsort(cell, kind="stable")
    return np.searchsorted(cell[order], np.arange(N_CELLS**2 + 1)), box[order]


def nearest_points(places: FloatArray, positions: FloatArray, triangles: IntArray) -> SurfacePoints:
    """Points of a mesh nearest to places (N, 3), among the triangles around the nearest vertices."""
    used = np.unique(triangles)
    count = min(N_NEAREST, len(used))
    near = np.asarray(cKDTree(positions[used]).query(places, k=count)[1]).reshape(len(places), count)
    found = SurfacePoints(np.zeros((len(places), 3), np.int64), np.zeros((len(places), 3)))
    order = np.argsort(triangles.reshape(-1), kind="stable")
    starts = np.searchsorted(triangles.reshape(-1)[order], np.arange(len(positions) + 1))
    for number, place in enumerate(places):
        vertices = used[near[number]]
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
    first_edge = corners[:, 1] - corners[:, 0]
    second_edge = corners[:, 2] - corners[:, 0]
    there = pixel - corners[:, 0]
    area = first_edge[:, 0] * second_edge[:, 1] - first_edge[:, 1] * second_edge[:, 0]
    area = np.where(np.abs(area) < 1e-12, np.inf, area)
    second = (there[:, 0] * second_edge[:, 1] - there[:, 1] * second_edge[:, 0]) / area
    third = (first_edge[:, 0] * there[:, 1] - first_edge[:, 1] * there[:, 0]) / area
    return np.stack([1.0 - second - third, second, third], axis=1)


def _nearest_weights(place: FloatArray, corners: FloatArray) -> FloatArray:
    """Barycentric weights (F, 3) of the points of triangles (F, 3, 3) nearest to a place.

    Source: Ericson 2005, Real-Time Collision Detection, section 5.1.5.
    """
    first_edge = corners[:, 1] - corners[:, 0]
    second_edge = corners[:, 2] - corners[:, 0]
    there = place - corners[:, 0]
    d11 = (first_edge * first_edge).sum(axis=1)
    d12 = (first_edge * second_edge).sum(axis=1)
    d22 = (second_edge * second_edge).sum(axis=1)
    d1, d2 = (there * first_edge).sum(axis=1), (there * second_edge).sum(axis=1)
    area = np.maximum(d11 * d22 - d12 * d12, 1e-30)
    second, third = (d22 * d1 - d12 * d2) / area, (d11 * d2 - d12 * d1) / area
    inner = np.stack([1.0 - second - third, second, third], axis=1)
    candidates = [np.where((inner >= 0).all(axis=1).reshape(-1, 1), inner, np.nan)]
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
