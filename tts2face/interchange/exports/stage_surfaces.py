"""Surfaces of the live preview: what can be seen, with as many triangles as its shape and motion need.

Fewer triangles for a surface: vertices are removed where their neighbours tell what they told.

Edges collapse onto one of their ends, so that the vertices that stay keep all their values. Many edges that do not
touch each other collapse in one pass, which is fast without compiled code. Source: Garland and Heckbert 1998,
Simplifying surfaces with color and texture using quadric error metrics.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tts2face.interchange.exports.surfaces import ExportSurface, divide_surface
from tts2face.models.face import Face
from tts2face.picture.light import N_HARMONICS
from tts2face.picture.surface import EYE_KIND, SKIN, STRANDS

N_SPACE = 3  # first numbers of a point: its place
SHARE_OF_PASS = 0.35  # of the vertices with the least errors, from which a pass chooses
LEAST_TURN_COS = 0.35  # of a triangle's normal: more than 70 degrees folds the surface
LEAST_QUALITY = 0.06  # of a triangle: 1 has equal sides, 0 is a line
LENGTH_SHARE = 1e-4  # of an edge's squared length in its error, so that plane regions keep compact triangles
MAX_PASSES = 80

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


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
        if not len(removed) and not len(refused):
            break
        for values in quadrics:
            np.add.at(values, targets[removed], values[removed])
        moved = targets[triangles]
        triangles = moved[_has_area(moved)]
    return triangles


def _seam_vertices(places: FloatArray) -> NDArray[np.bool_]:
    """Whether another vertex is at the same place, for each vertex."""
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
    sums = (np.asarray(gather @ one.reshape(len(one), math.prod(one.shape[1:]))) for one in each)
    return _Quadrics(*(one.reshape(n, *shape.shape[1:]) for one, shape in zip(sums, each, strict=True)))


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
    (before, old), (after, new) = (_normals(places, one[changed]) for one in (triangles, moved))
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


HIDDEN_SKY = 0.045  # share of the sky that a vertex hidden from all sides has in a light field
HIDDEN_MM = 5.0  # error of hidden skin, which is removed
SKIN_MM, MOUTH_MM = 0.8, 0.2  # error of skin that no channel moves, and the least one, of lips and lids
EYE_MM, INSIDE_MM, CLOTH_MM = 0.3, 0.25, 1.2  # of eyeballs; teeth, gums and tongue; clothes
CLOTH_LENGTH_MM = 150.0  # of a surface that is no part of the head
LEAST_TRIANGLES = 200  # of a surface that is reduced
LEAST_PHOTO_TRIANGLES = 500  # in a photograph, whose lids are narrow and fit the skin exactly
N_MOTIONS = 3  # principal motions of a surface, which its triangles interpolate
LIGHT_MM = 4.0  # error of the whole sky's light
TEXTURE_SHARE = 0.3  # of a shift of the texture over the surface in its error
BACK_OF_EYE = -0.35  # cosine to the front, beyond which no turn of an eyeball shows its surface


def stage_surfaces(face: Face, fields: NDArray[np.float32], moves: NDArray[np.float32]) -> list[ExportSurface]:
    """Surfaces of a face for the preview, vertices in the order in which they are drawn.

    Parameters
    ----------
    fields : (V, 20)
        Light fields as `tts2face.picture.light.light_fields` makes them.
    moves : (K, V, 3)
        Displacements in mm of the channels at weight 1.
    """
    light = fields[:, [0, N_HARMONICS + 1]]
    sky = np.maximum(light[:, 0], light.sum(axis=1))
    shown = (sky >= HIDDEN_SKY) | moves.any(axis=(0, 2))
    return [_along_curve(face, _reduced(face, one, shown, (moves, light))) for one in divide_surface(face)]


def _reduced(
    face: Face,
    surface: ExportSurface,
    shown: NDArray[np.bool_],
    values: tuple[NDArray[np.float32], NDArray[np.float32]],
) -> ExportSurface:
    """The surface without what no view shows, and with fewer triangles; cards of hair stay as they are."""
    part, own, triangles = surface.part, surface.vertices, surface.triangles
    is_photo = face.light.is_flat and part.texture == 0
    if part.kind == STRANDS or len(triangles) < (LEAST_PHOTO_TRIANGLES if is_photo else LEAST_TRIANGLES):
        return surface
    points = _points(face, surface, *values)
    if is_photo:
        shown = np.ones_like(shown)
    tolerances = _tolerances(surface, points[:, :N_SPACE], shown, values[0], is_skin=is_photo or part.kind == SKIN)
    triangles = decimate(points, triangles, tolerances)
    if part.kind == SKIN:
        triangles = triangles[shown[own[triangles]].any(axis=1)]
    elif part.kind == EYE_KIND:
        triangles = triangles[_fronts(face, own)[triangles].any(axis=1)]
    return ExportSurface(part, own, triangles)


def _points(face: Face, surface: ExportSurface, moves: NDArray[np.float32], light: NDArray[np.float32]) -> FloatArray:
    """Places (n, 3) in mm beside light, principal motions and texture coordinates, which triangles interpolate."""
    own, triangles = surface.vertices, surface.triangles
    places = face.vertices[own].astype(np.float64)
    columns = [places, LIGHT_MM * light[own]]
    if moves[:, own].any():
        moved = moves[:, own].transpose(1, 0, 2).reshape(len(own), -1)
        columns.append(moved @ np.linalg.eigh((moved.T @ moved).astype(np.float64))[1][:, -N_MOTIONS:])
    if surface.part.is_textured and face.uv is not None:
        uv = face.uv[own].astype(np.float64)
        p, q = (places[triangles[:, k]] - places[triangles[:, 0]] for k in (1, 2))
        a, b = (uv[triangles[:, k]] - uv[triangles[:, 0]] for k in (1, 2))
        in_texture = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum()
        scale = np.sqrt(np.linalg.norm(np.cross(p, q), axis=1).sum() / max(in_texture, 1e-9))
        columns.append(TEXTURE_SHARE * scale * uv)
    return np.hstack(columns)


def _tolerances(
    surface: ExportSurface, places: FloatArray, shown: NDArray[np.bool_], moves: NDArray[np.float32], *, is_skin: bool
) -> FloatArray:
    """Errors (n,) in mm of a surface: least where many channels move it, which lips and lids do."""
    own, kind = surface.vertices, surface.part.kind
    if not is_skin:
        is_cloth = np.ptp(places, axis=0).max() > CLOTH_LENGTH_MM
        return np.full(len(own), EYE_MM if kind == EYE_KIND else CLOTH_MM if is_cloth else INSIDE_MM)
    lengths = np.linalg.norm(moves, axis=2)
    largest = np.maximum(lengths.max(axis=1, keepdims=True), 1e-6)
    activity = (lengths[:, own] / largest).sum(axis=0)
    return np.where(shown[own], np.maximum(SKIN_MM / (1 + 0.5 * activity), MOUTH_MM), HIDDEN_MM)


def _fronts(face: Face, own: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Whether a turn of the eyeball can show each of some vertices."""
    places = face.vertices[own]
    centres = np.stack([eye.centre for eye in face.eyes]) if face.eyes else places.mean(axis=0, keepdims=True)
    away = places[:, None] - centres
    nearest = np.linalg.norm(away, axis=2).argmin(axis=1)
    offset = away[np.arange(len(places)), nearest]
    return np.asarray(offset[:, 2] > BACK_OF_EYE * np.linalg.norm(offset, axis=1))


def _along_curve(face: Face, surface: ExportSurface) -> ExportSurface:
    """The surface with triangles along a curve that fills space, and vertices in the order of their first use.

    Neighbours follow each other, so that few vertices are shaded twice. Source: Morton 1966.
    """
    corners = surface.vertices[surface.triangles]
    middle = face.vertices[corners].mean(axis=1)
    low, high = middle.min(axis=0), middle.max(axis=0)
    cells = ((middle - low) / np.maximum(high - low, 1e-6) * 1023).astype(np.int64)
    code = np.zeros(len(cells), np.int64)
    for bit in range(10):
        for axis in range(3):
            code |= ((cells[:, axis] >> bit) & 1) << (3 * bit + axis)
    used = corners[np.argsort(code, kind="stable")].ravel()
    vertices, first, places = np.unique(used, return_index=True, return_inverse=True)
    rank = np.argsort(np.argsort(first))
    return ExportSurface(surface.part, vertices[np.argsort(first)], rank[places.ravel()].reshape(-1, 3))
