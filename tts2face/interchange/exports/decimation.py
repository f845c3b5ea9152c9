"""Fewer triangles for a surface: vertices are removed where their neighbours carry the same information.

Edges collapse onto one of their ends, so that the vertices that stay keep all their values. Many edges that do not
touch each other collapse in one pass, which is fast without compiled code. Source: Garland and Heckbert 1998,
Simplifying surfaces with color and texture using quadric error metrics.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tts2face.numeric.arrays import FloatArray, IntArray

N_SPACE = 3  # first numbers of a point: its place
SHARE_OF_PASS = 0.35  # of the vertices with the least errors, from which a pass chooses
LEAST_TURN_COS = 0.35  # of a triangle's normal: more than 70 degrees folds the surface
LEAST_QUALITY = 0.06  # of a triangle: 1 has equal sides, 0 is a line
LENGTH_SHARE = 1e-4  # of an edge's squared length in its error, so that plane regions keep compact triangles
MAX_PASSES = 80


class _Quadrics(NamedTuple):
    """Squared distance of a point x to the planes around each of n vertices: x A x + 2 b x + c, and their area."""

    a: FloatArray
    b: FloatArray
    c: FloatArray
    area: FloatArray


def decimate(points: FloatArray, triangles: IntArray, tolerance: FloatArray) -> IntArray:
    """Triangles (G, 3) of the vertices that stay.

    Parameters
    ----------
    points : (n, d)
        Places in mm, and further numbers that triangles interpolate, scaled such that 1 counts as 1 mm.
    triangles : (F, 3)
        Corners. Vertices at open edges move along them only; those of a seam, which share a place, stay.
    tolerance : (n,)
        Error in mm, as root mean square over the surface around a vertex, beyond which it stays.
    """
    if points.ndim != 2 or len(tolerance) != len(points) or (len(triangles) and triangles.max() >= len(points)):
        raise ValueError(f"{points.shape} points, {tolerance.shape} tolerances and the triangles do not fit each other")
    points = points - points.mean(axis=0)
    stays = _seam_vertices(points[:, :N_SPACE])
    quadrics = _quadrics(points, triangles)
    n, folds = len(points), np.zeros(0, np.int64)
    for _ in range(MAX_PASSES):
        wanted = _pass(points, triangles, tolerance, quadrics, (stays, folds))
        targets = _without_folds(points, triangles, wanted)
        refused = np.flatnonzero(targets != wanted)
        folds = np.concatenate([folds, refused * n + wanted[refused]])
        removed = np.flatnonzero(targets != np.arange(n))
        # nothing was removed, and nothing would be in another pass
        if not len(removed) and not len(refused):
            break
        for values in quadrics:
            np.add.at(values, targets[removed], values[removed])
        moved = targets[triangles]
        triangles = moved[_has_area(moved)]
    return triangles


def _seam_vertices(places: FloatArray) -> NDArray[np.bool_]:
    """Whether another vertex is at the same place, for each vertex."""
    # a tenth of a micrometre: places of one seam differ by rounding alone
    _, same, counts = np.unique(np.rint(places * 1e4).astype(np.int64), axis=0, return_inverse=True, return_counts=True)
    return np.asarray(counts[same.ravel()] > 1)


def _half_edges(triangles: IntArray) -> IntArray:
    return np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])


def _unique_pairs(pairs: IntArray, n: int) -> tuple[IntArray, IntArray]:
    """Different pairs of numbers below n in order, and how often each occurs."""
    keys, counts = np.unique(pairs[:, 0] * n + pairs[:, 1], return_counts=True)
    return np.column_stack(np.divmod(keys, n)), counts


def _has_area(triangles: IntArray) -> NDArray[np.bool_]:
    a, b, c = triangles.T
    return np.asarray((a != b) & (b != c) & (c != a))


def _quadrics(points: FloatArray, triangles: IntArray) -> _Quadrics:
    p, q, r = (points[corner] for corner in triangles.T)
    first, second = q - p, r - p
    first = first / np.maximum(np.linalg.norm(first, axis=1, keepdims=True), 1e-9)
    second = second - (second * first).sum(axis=1, keepdims=True) * first
    height = np.linalg.norm(second, axis=1, keepdims=True)
    area = np.linalg.norm(q - p, axis=1) * height[:, 0] / 2
    second = second / np.maximum(height, 1e-9)
    along, across = (p * first).sum(axis=1), (p * second).sum(axis=1)
    plane = np.eye(points.shape[1]) - first[:, :, None] * first[:, None] - second[:, :, None] * second[:, None]
    linear = along[:, None] * first + across[:, None] * second - p
    constant = (p * p).sum(axis=1) - along**2 - across**2
    whole = _summed(triangles, len(points), _Quadrics(plane, linear, constant, np.ones(len(area))), area)
    borders = _borders(points, triangles)
    return _Quadrics(*(a + b for a, b in zip(whole, borders, strict=True)))


def _summed(corners: IntArray, n: int, each: _Quadrics, share: FloatArray) -> _Quadrics:
    """Sums over the n vertices of what each of the rows of corners (m, k) has, times its share."""
    from scipy.sparse import csr_array

    rows = np.tile(np.arange(len(corners)), corners.shape[1])
    gather = csr_array((np.tile(share, corners.shape[1]), (corners.T.ravel(), rows)), shape=(n, len(corners)))
    sums = (np.asarray(gather @ values.reshape(len(values), math.prod(values.shape[1:]))) for values in each)
    return _Quadrics(*(values.reshape(n, *shape.shape[1:]) for values, shape in zip(sums, each, strict=True)))


def _borders(points: FloatArray, triangles: IntArray) -> _Quadrics:
    """Squared distance to the lines of open edges, without an area."""
    edges, counts = _unique_pairs(np.sort(_half_edges(triangles), axis=1), len(points))
    ends = edges[counts == 1]
    start, along = points[ends[:, 0]], points[ends[:, 1]] - points[ends[:, 0]]
    squared = (along**2).sum(axis=1)
    unit = along / np.maximum(np.sqrt(squared), 1e-9)[:, None]
    share = (start * unit).sum(axis=1)
    line = np.eye(points.shape[1]) - unit[:, :, None] * unit[:, None]
    linear, constant = share[:, None] * unit - start, (start * start).sum(axis=1) - share**2
    return _summed(ends, len(points), _Quadrics(line, linear, constant, np.zeros(len(ends))), squared)


def _pass(
    points: FloatArray,
    triangles: IntArray,
    tolerance: FloatArray,
    quadrics: _Quadrics,
    refused: tuple[NDArray[np.bool_], IntArray],
) -> IntArray:
    """Vertex (n,) to which each vertex moves: itself, unless it is removed.

    `refused` marks the vertices that stay, and holds the edges, as numbers, that fold the surface.
    """
    n, (stays, folds) = len(points), refused
    edges = _half_edges(triangles)
    ends, counts = _unique_pairs(np.concatenate([edges, edges[:, ::-1]]), n)
    is_open = np.zeros(n, bool)
    is_open[ends[counts == 1]] = True
    # The triangles at an edge, and no others, join its ends; a vertex of an open edge moves along one.
    fits = (_common_neighbours(ends, n) == counts) & (~is_open[ends[:, 0]] | (counts == 1)) & ~stays[ends[:, 0]]
    fits &= ~np.isin(ends[:, 0] * n + ends[:, 1], folds)
    i, j = ends[fits].T
    to = points[j]
    error = ((to[:, None] @ (quadrics.a[i] + quadrics.a[j]))[:, 0] * to).sum(axis=1)
    error += 2 * ((quadrics.b[i] + quadrics.b[j]) * to).sum(axis=1) + quadrics.c[i] + quadrics.c[j]
    error += LENGTH_SHARE * ((to - points[i]) ** 2).sum(axis=1) * quadrics.area[i]
    error = np.maximum(error, 0) / np.maximum(quadrics.area[i] + quadrics.area[j], 1e-9) / tolerance[i] ** 2
    order = np.argsort(error, kind="stable")
    vertex, first = np.unique(i[order], return_index=True)
    least = np.full(n, np.inf)
    least[vertex] = error[order][first]
    targets = np.arange(n)
    targets[vertex] = j[order][first]
    chosen = least <= min(1.0, float(np.quantile(least[vertex], SHARE_OF_PASS))) if len(vertex) else np.zeros(n, bool)
    rank = np.full(n, n)
    rank[np.argsort(np.where(chosen, least, np.inf), kind="stable")] = np.arange(n)
    around = np.full(n, n)
    np.minimum.at(around, ends[:, 0], np.where(chosen[ends[:, 1]], rank[ends[:, 1]], n))
    chosen &= rank < around  # the least of all its neighbours: no triangle loses two vertices
    return np.where(chosen, targets, np.arange(n))


def _common_neighbours(ends: IntArray, n: int) -> IntArray:
    """Vertices next to both ends of each edge."""
    from scipy.sparse import csr_array

    near = csr_array((np.ones(len(ends), np.int64), (ends[:, 0], ends[:, 1])), shape=(n, n))
    both = (near @ near).multiply(near).tocsr()
    both.sort_indices()
    counts = np.zeros(len(ends), np.int64)
    found = both.tocoo()
    keys = ends[:, 0] * n + ends[:, 1]
    counts[np.searchsorted(keys, found.row.astype(np.int64) * n + found.col)] = found.data
    return counts


def _without_folds(points: FloatArray, triangles: IntArray, targets: IntArray) -> IntArray:
    """The moves without those that turn a triangle over or make it a line."""
    places, moved = points[:, :N_SPACE], targets[triangles]
    changed = (moved != triangles).any(axis=1) & _has_area(moved)
    (before, old), (after, new) = (_normals(places, values[changed]) for values in (triangles, moved))
    turned = (before * after).sum(axis=1) < LEAST_TURN_COS
    wrong = turned | (new < np.minimum(old, LEAST_QUALITY))
    corners = triangles[changed][wrong].ravel()
    kept = targets.copy()
    kept[corners] = corners
    return kept


def _normals(places: FloatArray, triangles: IntArray) -> tuple[FloatArray, FloatArray]:
    """Unit normals (F, 3) of triangles, and their quality (F,)."""
    a, b, c = (places[corner] for corner in triangles.T)
    normals = np.cross(b - a, c - a)
    lengths = np.maximum(np.linalg.norm(normals, axis=1), 1e-12)
    sides = ((b - a) ** 2 + (c - b) ** 2 + (a - c) ** 2).sum(axis=1)
    return normals / lengths[:, None], 2 * np.sqrt(3) * lengths / np.maximum(sides, 1e-12)
