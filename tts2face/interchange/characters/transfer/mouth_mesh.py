"""Mesh around a closed mouth, made ready for its cut: small holes of a scan filled, long edges divided."""

from dataclasses import replace

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from tts2face.interchange.characters.transfer.parts import triangles_of
from tts2face.interchange.characters.transfer.skin import WELD_MM
from tts2face.models.face import Face
from tts2face.models.landmarks import INNER_LIP_LOWER, INNER_LIP_UPPER
from tts2face.numeric.arrays import FloatArray, IntArray, Mask

# Relative to the width of the mouth, about 50 mm.
HOLE_SIDE = 0.7  # of the box of a hole that is filled: eyes and mouths without an inside are wider
HOLE_ROOM = (0.8, 0.4, 0.6)  # half sides of the room around the lips in which holes are filled; nostrils lie above it
FINE, COARSER = 0.04, 0.12  # longest edge at the lips, and by how much of the distance it grows
REFINED = 0.9  # distance from the lips within which edges are divided
N_ROUNDS = 5  # of halving: edges of 2 mm from those of 60


def prepare_mouth(face: Face, landmarks: FloatArray) -> Face:
    """Face without shapes whose skin around the lips has no small holes and no long edges."""
    return _divide_edges(_fill_holes(face, landmarks), landmarks)


def _seam(landmarks: FloatArray) -> tuple[FloatArray, float]:
    """Middles (11, 3) of the lips' inner edges, and the width of the mouth."""
    upper, lower = (landmarks[list(line)] for line in (INNER_LIP_UPPER, INNER_LIP_LOWER))
    return (upper + lower) / 2, float(np.linalg.norm(upper[0] - upper[-1]))


def _places_of(face: Face) -> IntArray:
    """(V,) number of the place of each vertex: vertices along seams of a texture share one."""
    keys = np.rint(face.vertices.astype(np.float64) / WELD_MM)
    return np.unique(keys, axis=0, return_inverse=True)[1].reshape(-1)


def _fill_holes(face: Face, landmarks: FloatArray) -> Face:
    seam, width = _seam(landmarks)
    rows, place = np.flatnonzero(triangles_of(face, "skin")), _places_of(face)
    near = (np.abs(face.vertices - seam.mean(axis=0)) < np.array(HOLE_ROOM) * width).all(axis=1)
    rows = rows[near[face.triangles[rows]].any(axis=1)]
    corners = face.triangles[rows].astype(np.int64)
    edges = np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]])
    of = np.tile(rows, 3)
    inverse, counts = np.unique(np.sort(place[edges], axis=1), axis=0, return_inverse=True, return_counts=True)[1:]
    single = counts[inverse.reshape(-1)] == 1
    added: list[tuple[int, int, int]] = []
    part_rows: list[int] = []
    middles: list[IntArray] = []
    for loop in _loops(edges[single], of[single], place):
        ring = loop[:, 1]
        # the rim of the room is no hole: it is wide
        if np.ptp(face.vertices[ring], axis=0).max() > HOLE_SIDE * width or not near[ring].all():
            continue
        added += [(b, a, len(face.vertices) + len(middles)) for a, b, _ in loop.tolist()]
        part_rows += loop[:, 2].tolist()
        middles.append(ring)
    if not added:
        return face
    own = np.repeat(np.arange(len(middles)), [len(ring) for ring in middles])
    share = np.repeat([1.0 / len(ring) for ring in middles], [len(ring) for ring in middles])
    means = sp.csr_matrix((share, (own, np.concatenate(middles))), (len(middles), len(face.vertices)))
    corners = np.concatenate([face.triangles, np.array(added, np.int64)])
    return _remade(face, corners, np.concatenate([np.arange(len(face.triangles)), part_rows]), means)


def _loops(edges: IntArray, of: IntArray, place: IntArray) -> list[IntArray]:
    """Closed loops of rows (start, end, triangle) of single edges (E, 2); holes that touch at a vertex are two."""
    following: dict[int, list[tuple[int, int, int]]] = {}
    for start, end, row in np.column_stack([edges, of]).tolist():
        following.setdefault(int(place[start]), []).append((start, end, row))
    loops: list[IntArray] = []
    for first in list(following):
        path, at = list[tuple[int, int, int]](), first
        while following.get(at):
            path.append(following[at].pop())
            at = int(place[path[-1][1]])
            back = next((n for n, (start, _, _) in enumerate(path) if place[start] == at), None)
            if back is not None:
                loops.append(np.array(path[back:], np.int64))
                del path[back:]
    return [loop for loop in loops if len(loop) > 2]


def _divide_edges(face: Face, landmarks: FloatArray) -> Face:
    seam, width = _seam(landmarks)
    across = np.linspace(seam[:-1], seam[1:], 4).reshape(-1, 3)
    for _ in range(N_ROUNDS):
        places, place = face.vertices.astype(np.float64), _places_of(face)
        far = np.asarray(cKDTree(across).query(places)[0])
        is_near = triangles_of(face, "skin") & (far < REFINED * width)[face.triangles].any(axis=1)
        corners = face.triangles.astype(np.int64)
        edges = np.stack([corners, np.roll(corners, -1, axis=1)], axis=-1)  # (F, 3, 2): edge k from corner k
        length = np.linalg.norm(places[edges[..., 0]] - places[edges[..., 1]], axis=-1)
        limit = FINE * width + COARSER * far[edges].min(axis=-1)
        is_long = is_near[:, None] & (length > limit)
        if not is_long.any():
            break
        # both triangles at an edge divide it, on either side of a seam of the texture
        keys = np.sort(place[edges].reshape(-1, 2), axis=1)
        number = np.unique(keys, axis=0, return_inverse=True)[1].reshape(-1)
        divided = np.zeros(int(number.max()) + 1, bool)
        divided[number[is_long.reshape(-1)]] = True
        face = _halved(face, edges, divided[number].reshape(-1, 3))
    return face


def _halved(face: Face, edges: IntArray, is_divided: Mask) -> Face:
    """Face whose triangles with edges (F, 3, 2) are divided at the middles of some of these."""
    ends, number = np.unique(np.sort(edges[is_divided], axis=1), axis=0, return_inverse=True)
    middle = np.full(is_divided.shape, -1, np.int64)
    middle[is_divided] = len(face.vertices) + number.reshape(-1)
    corners, count = face.triangles.astype(np.int64), is_divided.sum(axis=1)
    pieces, of = [corners[count == 0]], [np.flatnonzero(count == 0)]
    for wanted in (1, 2, 3):
        rows = np.flatnonzero(count == wanted)
        # turn each so that its first edges are the divided ones; of two, the undivided one is the last
        first = is_divided[rows].argmax(axis=1) if wanted == 1 else (is_divided[rows].argmin(axis=1) + 1) % 3
        a, b, c = (corners[rows, (first + k) % 3] for k in range(3))
        ab, bc, ca = (middle[rows, (first + k) % 3] for k in range(3))
        split = {
            1: [(a, ab, c), (ab, b, c)],
            2: [(ab, b, bc), (a, ab, bc), (a, bc, c)],
            3: [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)],
        }[wanted]
        pieces += [np.column_stack(triangle) for triangle in split]
        of += [rows] * len(split)
    half = np.full(ends.size, 0.5)
    means = sp.csr_matrix((half, (np.repeat(np.arange(len(ends)), 2), ends.ravel())), (len(ends), len(face.vertices)))
    return _remade(face, np.concatenate(pieces), np.concatenate(of), means)


def _remade(face: Face, corners: IntArray, of: IntArray, means: sp.csr_matrix) -> Face:
    """Face with triangles (G, 3), each of the part of an old one (G,), and vertices that are means of old ones."""
    part = np.repeat(np.arange(len(face.parts)), [part.count for part in face.parts])[of]
    order = np.argsort(part, kind="stable")
    counts = np.bincount(part, minlength=len(face.parts))
    firsts = np.cumsum(counts) - counts

    def extended(values: np.ndarray) -> np.ndarray:
        return np.concatenate([values, (means @ values.astype(np.float64)).astype(values.dtype)])

    n = len(face.vertices) + means.shape[0]
    return replace(
        face, vertices=extended(face.vertices), colours=extended(face.colours),
        uv=None if face.uv is None else extended(face.uv), triangles=corners[order].astype(np.int32),
        parts=tuple(
            replace(own, first=int(first), count=int(count))
            for own, first, count in zip(face.parts, firsts, counts, strict=True)
        ),
        shapes=np.zeros((0, n, 3), np.float32),
    )  # fmt: skip
