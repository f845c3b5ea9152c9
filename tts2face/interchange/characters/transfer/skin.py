"""Skin of a head as one connected surface, for distances along it, smoothness and the sides of lips and lids."""

from dataclasses import dataclass, field, replace

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from tts2face.interchange.characters.landmarks import SKIN, part_triangles
from tts2face.models.face import Face, keep_parts
from tts2face.models.landmarks import (
    LEFT_LIDS,
    OUTER_LIP_LOWER,
    OUTER_LIP_UPPER,
    RIGHT_LIDS,
)
from tts2face.numeric.arrays import FloatArray, IntArray, Mask, vertex_normals
from tts2face.picture.occlusion import bake_occlusion
from tts2face.processes.threads import available_cores

BURIED = 0.46  # share of all directions, half of which a vertex faces, from which the inside of a mouth is hidden
WELD_MM = 1e-3  # vertices along seams of a texture lie at one place, to rounding
# Upper and lower line of the mouth and of each eye; ring k has the labels 2 k + 1 (upper) and 2 k + 2 (lower).
RINGS = ((OUTER_LIP_UPPER, OUTER_LIP_LOWER), RIGHT_LIDS, LEFT_LIDS)
REACH = 0.6  # of the width of a mouth or an eye: how far along the surface lips and lids reach from their lines


@dataclass(frozen=True, slots=True, eq=False)
class Skin:
    """Connected skin of a face.

    Parameters
    ----------
    vertices, triangles : (S, 3), (T, 3)
        Millimetres; vertices at one place are one.
    of_face : (V,)
        Its vertex for each vertex of the face; -1 for vertices of other parts.
    is_seen : (S,)
        Whether a vertex is seen from outside: not the inside of mouth and lids.
    landmarks : (468, 3)
    side : (S,)
        Lip or lid that a vertex belongs to, as `RINGS` number them; 0 elsewhere.
    """

    vertices: FloatArray
    triangles: IntArray
    of_face: IntArray
    is_seen: Mask
    landmarks: FloatArray
    side: IntArray = field(default_factory=lambda: np.zeros(0, np.int64))

    def normals(self, places: FloatArray | None = None) -> FloatArray:
        """Unit normals (S, 3), of the skin at rest or with its vertices at other places."""
        return vertex_normals(self.vertices if places is None else places, self.triangles)

    def rows(self) -> IntArray:
        """(S,) a vertex of the face for each of the skin."""
        rows = np.zeros(len(self.vertices), np.int64)
        used = np.flatnonzero(self.of_face >= 0)
        rows[self.of_face[used]] = used
        return rows

    def laplacian(self) -> sp.csr_matrix:
        """(S, S) difference of each vertex from the mean of its neighbours."""
        graph = self.graph(is_weighted=False)
        n_neighbours = np.maximum(np.asarray(graph.sum(axis=1)).ravel(), 1.0)
        found: sp.csr_matrix = (sp.eye(len(self.vertices)) - sp.diags(1.0 / n_neighbours) @ graph).tocsr()
        return found

    def graph(self, *, is_weighted: bool = True) -> sp.csr_matrix:
        """(S, S) lengths of edges in mm, or ones."""
        t = self.triangles
        edges = np.unique(np.sort(np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]]), axis=1), axis=0)
        lengths = np.linalg.norm(self.vertices[edges[:, 0]] - self.vertices[edges[:, 1]], axis=1) + 1e-9
        values = lengths if is_weighted else np.ones(len(edges))
        half = sp.coo_matrix((values, (edges[:, 0], edges[:, 1])), (len(self.vertices),) * 2)
        both: sp.csr_matrix = (half + half.T).tocsr()
        return both

    def nearest(self, places: FloatArray, side: int | None = None) -> IntArray:
        """(N,) seen vertices nearest to places (N, 3), of a side where it has any."""
        candidates = np.flatnonzero(self.is_seen if side is None else self.is_seen & (self.side == side))
        if not len(candidates):
            candidates = np.flatnonzero(self.is_seen)
        nearest: IntArray = candidates[np.asarray(cKDTree(self.vertices[candidates]).query(places)[1])]
        return nearest

    def spread(self, moves: FloatArray) -> FloatArray:
        """Displacements (K, V, 3) of the face's vertices, from those (K, S, 3) of the skin; 0 for other parts."""
        rows = np.flatnonzero(self.of_face >= 0)
        moved = np.zeros((len(moves), len(self.of_face), 3))
        moved[:, rows] = moves[:, self.of_face[rows]]
        return moved


def build_skin(face: Face, landmarks: FloatArray, cut: IntArray | None = None) -> Skin:
    """Skin of a face whose landmarks (468, 3) are known; `cut` (V,) is 1 and 2 for vertices of lips that are parted."""
    corners = part_triangles(face, SKIN)
    used, flat = np.unique(corners, return_inverse=True)
    places = face.vertices[used].astype(np.float64)
    lip = np.zeros(len(used), np.int64) if cut is None else cut[used]
    keys = np.column_stack([np.rint(places / WELD_MM), lip])
    _, first, welded = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    welded = welded.ravel()
    triangles = welded[flat].reshape(-1, 3)
    is_whole = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    of_face = np.full(len(face.vertices), -1, np.int64)
    of_face[used] = welded
    hidden = np.zeros(len(first))
    np.maximum.at(hidden, welded, hidden_shares(face)[used])
    skin = Skin(places[first], triangles[is_whole], of_face, hidden < BURIED, landmarks)
    return replace(skin, side=_sides(skin, lip[first]))


def hidden_shares(face: Face) -> FloatArray:
    """(V,) share of all directions from which skin, eyes, teeth and tongue hide a vertex."""
    bare = keep_parts(face, lambda part: not part.name.startswith(("hair", "brow", "lash")))
    occlusion = bake_occlusion(bare, available_cores()).occlusion
    assert occlusion is not None
    shares: FloatArray = np.unpackbits(occlusion[0], axis=1).mean(axis=1)
    return shares


def _sides(skin: Skin, lip: IntArray) -> IntArray:
    """Lip or lid (S,) whose line of landmarks is nearer along the surface: an opening separates them.

    `lip` (S,) is 1 and 2 for vertices that are known to be of the upper and the lower lip.
    """
    graph, side = skin.graph(), np.zeros(len(skin.vertices), np.int64)
    for number, lines in enumerate(RINGS):
        corners = skin.landmarks[[lines[0][0], lines[0][-1]]]
        reach = REACH * float(np.linalg.norm(corners[0] - corners[1]))
        # the corners belong to both lines, and their neighbours to either
        seeds = [np.unique(skin.nearest(skin.landmarks[list(line[2:-2])])) for line in lines]
        if number == 0:
            seeds = [np.union1d(rows, np.flatnonzero(lip == k)) for k, rows in enumerate(seeds, 1)]
        upper, lower = (dijkstra(graph, False, rows, min_only=True, limit=reach) for rows in seeds)
        is_near = np.isfinite(np.minimum(upper, lower))
        side[is_near] = 2 * number + np.where(upper <= lower, 1, 2)[is_near]
    return side
