"""Parts of a head that are not skin: which they are, and how they move with the skin and the jaw of the source."""

from dataclasses import replace

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import dijkstra

from tts2face.interchange.characters.transfer.registration import Similarity
from tts2face.models.face import Face
from tts2face.models.landmarks import EYE_OUTER_LEFT, EYE_OUTER_RIGHT, LOWER_LIP_INNER_MID, UPPER_LIP_INNER_MID
from tts2face.numeric.arrays import FloatArray, IntArray, Mask, connected_pieces, nearest_rotation, smoothstep

# Beginnings of the names of parts, of shipped faces and of imported ones.
KINDS = {
    "skin": ("skin",),
    "mouth": ("mouth",),
    "eyes": ("eyes", "sclera", "iris"),
    "teeth": ("teeth", "gums"),
    "tongue": ("tongue",),
    "lashes": ("lash",),
    "brows": ("brow",),
}
BITE = -0.02  # of the distance of the outer eye corners: height over the lips' line at which teeth meet
BITE_RISES = (0.0, 0.08, 0.15, 0.22)  # of the plane in which they meet, in mm per mm towards the back
BOTH_JAWS = 0.11  # of the distance of the outer eye corners, on both sides of the bite: gums of both jaws in one piece
STILL_MM = 0.05  # a shape that moves the source's lower teeth less does not move the jaw


def is_kind(name: str, kind: str) -> bool:
    """Whether a part of this name is of a kind of `KINDS`, or of none of them (``other``)."""
    if kind == "other":
        return not any(name.startswith(beginnings) for beginnings in KINDS.values())
    return name.startswith(KINDS[kind])


def triangles_of(face: Face, *kinds: str) -> Mask:
    """(F,) triangles of the parts of these kinds."""
    chosen = np.zeros(len(face.triangles), bool)
    for part in face.parts:
        if any(is_kind(part.name, kind) for kind in kinds):
            chosen[part.first : part.first + part.count] = True
    return chosen


def vertices_of(face: Face, *kinds: str) -> IntArray:
    """Vertices that triangles of the parts of these kinds use."""
    return np.unique(face.triangles[triangles_of(face, *kinds)]).astype(np.int64)


def jaw_shares(face: Face, landmarks: FloatArray) -> FloatArray:
    """(V,) share of the jaw's motion that each vertex takes: 1 for lower teeth and tongue, 0 beside teeth and tongue.

    A connected piece belongs to the jaw on whose side of the bite its middle lies; one that holds the gums of both is
    divided softly, by what is nearer along its surface.
    """
    shares = np.zeros(len(face.vertices))
    is_tongue = np.zeros(len(face.triangles), bool)
    for part in face.parts:
        if is_kind(part.name, "tongue") and "gum" not in part.name.lower():
            is_tongue[part.first : part.first + part.count] = True
    shares[face.triangles[is_tongue]] = 1.0
    corners = face.triangles[triangles_of(face, "teeth", "tongue") & ~is_tongue]
    if not len(corners):
        return shares
    used, flat = np.unique(corners, return_inverse=True)
    size = float(np.linalg.norm(landmarks[EYE_OUTER_LEFT] - landmarks[EYE_OUTER_RIGHT]))
    piece = np.unique(connected_pieces(corners, len(face.vertices))[used], return_inverse=True)[1].reshape(-1)
    above = _above_bite(face.vertices[used].astype(np.float64), piece, landmarks, size)
    own = np.zeros(len(used))
    for number in np.unique(piece).tolist():
        rows = np.flatnonzero(piece == number)
        low, high = float(above[rows].min()), float(above[rows].max())
        if min(-low, high) < BOTH_JAWS * size:
            own[rows] = float(above[rows].mean() < 0)
            continue
        graph = _edge_graph(face.vertices[used].astype(np.float64), flat.reshape(-1, 3))
        far = [
            dijkstra(graph, False, seeds, min_only=True)
            for seeds in (rows[above[rows] > 0.7 * high], rows[above[rows] < 0.7 * low])
        ]
        own[rows] = smoothstep(far[0][rows] / np.maximum(far[0][rows] + far[1][rows], 1e-6), 0.35, 0.65)
    shares[used] = own
    return shares


def _above_bite(places: FloatArray, piece: IntArray, landmarks: FloatArray, size: float) -> FloatArray:
    """(N,) heights of places (N, 3) above the plane in which upper and lower teeth meet.

    The plane is that near the line of the lips which leaves the widest gap between the middles of the pieces.
    """
    seam = landmarks[[UPPER_LIP_INNER_MID, LOWER_LIP_INNER_MID]].mean(axis=0)
    best = -np.inf
    found: FloatArray = places[:, 1] - seam[1]
    for rise in BITE_RISES:
        above = places[:, 1] - seam[1] - rise * (seam[2] - places[:, 2])
        middles = np.sort(np.bincount(piece, above) / np.bincount(piece))
        between, gaps = (middles[1:] + middles[:-1]) / 2, np.diff(middles)
        scores = gaps - 2 * np.abs(between - BITE * size)
        if len(scores) and scores.max() > best:
            best, found = float(scores.max()), above - between[scores.argmax()]
    return found


def _edge_graph(places: FloatArray, triangles: IntArray) -> sp.csr_matrix:
    pairs = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    lengths = np.linalg.norm(places[pairs[:, 0]] - places[pairs[:, 1]], axis=1) + 1e-9
    graph: sp.csr_matrix = sp.coo_matrix((lengths, pairs.T), (len(places),) * 2).tocsr()
    return graph.maximum(graph.T)


def move_jaw(
    face: Face,
    shapes: FloatArray,
    shares: FloatArray,
    teeth: tuple[FloatArray, FloatArray],
) -> None:
    """Move lower teeth and tongue by their shares (V,) in shapes (K, V, 3), as rigidly as the source's lower teeth.

    `teeth` are places (N, 3) and displacements (K, N, 3) of the source's, in the target's millimetres.
    """
    jaw = np.flatnonzero(shares)
    start, moves = teeth
    middle = start.mean(axis=0)
    apart = face.vertices[jaw].astype(np.float64) - middle
    for number, moved in enumerate(moves):
        if len(jaw) and np.abs(moved).max() >= STILL_MM:
            there = start + moved
            turn = nearest_rotation(np.einsum("nc,nd->cd", there - there.mean(axis=0), start - middle))
            shapes[number, jaw] = shares[jaw, None] * (apart @ (turn - np.eye(3)).T + moved.mean(axis=0))


def add_teeth(face: Face, source: Face, similarity: Similarity) -> Face:
    """Face without shapes that has the source's teeth, gums and tongue, too."""
    parts = [part for part in source.parts if is_kind(part.name, "teeth") or is_kind(part.name, "tongue")]
    corners = np.concatenate([source.triangles[part.first : part.first + part.count] for part in parts])
    used, corners = np.unique(corners, return_inverse=True)
    firsts = len(face.triangles) + np.cumsum([0, *(part.count for part in parts)])
    n = len(face.vertices) + len(used)
    added = tuple(
        replace(part, name=f"{'tongue' if part.name == 'tongue' else 'teeth'}:{part.name}", first=int(first))
        for part, first in zip(parts, firsts, strict=False)
    )
    return replace(
        face,
        vertices=np.concatenate([face.vertices, similarity.places(source.vertices[used])]).astype(np.float32),
        colours=np.concatenate([face.colours, source.colours[used]]),
        uv=None if face.uv is None else np.concatenate([face.uv, np.zeros((len(used), 2), np.float32)]),
        triangles=np.concatenate([face.triangles, len(face.vertices) + corners.reshape(-1, 3)]).astype(np.int32),
        parts=(*face.parts, *added), shapes=np.zeros((0, n, 3), np.float32),
    )  # fmt: skip
