"""Inner walls of hollow statues and of meshes with a thickness, left out: only what is seen from outside moves."""

from dataclasses import replace

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from tts2face.interchange.characters.transfer.parts import triangles_of
from tts2face.interchange.characters.transfer.skin import WELD_MM, hidden_shares
from tts2face.models.face import Face
from tts2face.numeric.arrays import FloatArray, IntArray, Mask, connected_pieces, vertex_normals

WALL_MM = 8.0  # greatest thickness of a wall
N_NEAR = 24  # vertices among which the other side of a wall is sought
OPPOSED = -0.3  # cosine of the normals of both sides of a wall, which coarse meshes do not have opposite each other
HOLLOW_SHARE = 0.5  # of the skin's vertices with another side: 0.9 of hollow heads, 0.1 of others by ears, nose, lips
N_ROUNDS = 40  # in which a side of a wall is decided by its neighbourhood
CLEARLY = 0.05  # mean difference of the hidden shares around a vertex without another side, of about 0.6
INSIDE = 0.4  # mean hidden share of what is left of an inner wall


def without_inner_wall(face: Face) -> tuple[Face, bool]:
    """Face without the inner side of its skin where it has two, and whether it had."""
    is_skin = triangles_of(face, "skin")
    corners = face.triangles[is_skin].astype(np.int64)
    used, flat = np.unique(corners, return_inverse=True)
    keys = np.rint(face.vertices[used].astype(np.float64) / WELD_MM)
    _, first, place = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    place = place.reshape(-1)
    welded, places = place[flat].reshape(-1, 3), face.vertices[used][first].astype(np.float64)
    normals = vertex_normals(places, welded)
    near = np.asarray(cKDTree(places).query(places, k=min(N_NEAR, len(places)))[1])
    way = places[near] - places[:, None]
    far = np.linalg.norm(way, axis=2)
    across = (normals[near] * normals[:, None]).sum(axis=2) < OPPOSED
    across &= ((way * normals[:, None]).sum(axis=2) < 0) & (far < WALL_MM)
    if across.any(axis=1).mean() < HOLLOW_SHARE:
        return face, False
    hidden = np.zeros(len(places))
    np.maximum.at(hidden, place, hidden_shares(face)[used])
    other = near[np.arange(len(near)), np.where(across, far, np.inf).argmin(axis=1)]
    more = _along_surface(np.where(across.any(axis=1), hidden - hidden[other], 0.0), welded)
    # where walls cross, neither is behind the other: what lies among the inner side belongs to it
    is_inner = more > np.where(across.any(axis=1), 0.0, CLEARLY)
    outer: Mask = ~np.asarray(is_inner[welded].all(axis=1))
    piece = connected_pieces(welded[outer], len(places))[welded[outer][:, 0]]
    means = np.bincount(piece, hidden[welded[outer]].mean(axis=1)) / np.maximum(np.bincount(piece), 1)
    outer[np.flatnonzero(outer)[means[piece] > INSIDE]] = False
    kept = np.ones(len(face.triangles), bool)
    kept[is_skin] = outer
    return keep_triangles(face, kept), True


def _along_surface(values: FloatArray, triangles: IntArray) -> FloatArray:
    """Values (N,) as their neighbourhoods have them: walls that touch or cross hide each other by chance."""
    edges = np.unique(np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    half = sp.coo_matrix((np.ones(len(edges)), edges.T), (len(values),) * 2)
    around: sp.csr_matrix = (half + half.T + sp.eye(len(values))).tocsr()
    count = np.asarray(around.sum(axis=1)).reshape(-1)
    for _ in range(N_ROUNDS):
        values = np.asarray(around @ values) / count
    return values


def keep_triangles(face: Face, kept: Mask) -> Face:
    """Face with the triangles (F,) that are kept, and all of its vertices."""
    counts = [int(kept[part.first : part.first + part.count].sum()) for part in face.parts]
    firsts = np.cumsum([0, *counts])
    parts = tuple(
        replace(part, first=int(first), count=count)
        for part, first, count in zip(face.parts, firsts, counts, strict=False)
    )
    return replace(face, parts=parts, triangles=face.triangles[kept])
