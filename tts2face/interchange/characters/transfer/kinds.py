"""Kinds of a head's parts by their places, where names do not tell: skin, eyes, teeth, tongue, lashes."""

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from tts2face.interchange.characters.character import Character
from tts2face.interchange.characters.eyeballs import mesh_components
from tts2face.interchange.characters.head_mesh import HeadMesh
from tts2face.interchange.characters.part_names import kind_by_name, shells_before_eyes
from tts2face.models.landmarks import (
    EYE_OUTER_LEFT,
    EYE_OUTER_RIGHT,
    INNER_LIP_LOWER,
    INNER_LIP_UPPER,
    LEFT_LIDS,
    MOUTH_CORNER_LEFT,
    MOUTH_CORNER_RIGHT,
    RIGHT_LIDS,
)
from tts2face.numeric.arrays import FloatArray, IntArray, Mask, connected_pieces

# Relative to the distance of the outer eye corners, about 90 mm.
NEAR_SKIN = 0.02  # of a landmark: the piece that it lies on is skin
MOUTH_WIDTH = 1.0  # of the mouth's own width: half side of that room
MOUTH_DEPTH, MOUTH_HEIGHT = 1.3, 0.45  # of the room behind the lips in which teeth, tongue and throat lie
LASH_REACH = 0.14  # from the lids within which most of a small loose piece is a lash
MIN_HITS = 0.05  # of all landmarks that lie on an unnamed piece
BEHIND = 0.01  # the foremost of the inner lips, for teeth
NEAR_LIDS = 0.9  # share of a card within that reach
PLACES = 1e4  # parts of that reach, in which vertices at one place do not differ
SMALL = 0.35  # of the triangles of the skin, below which a loose piece is a lash, a tooth, or gums


def drop_shells(head: HeadMesh, character: Character) -> HeadMesh:
    """Head without shells before its eyes that are not transparent."""
    is_shell = np.isin(head.piece_of, shells_before_eyes(character))
    return head.keep(~is_shell) if is_shell.any() and not is_shell.all() else head


def sort_kinds(head: HeadMesh, character: Character, landmarks: FloatArray) -> HeadMesh:
    """Head with the kind of each triangle: by its name, otherwise by the place of its connected piece.

    The pieces on which landmarks (468, 3) lie are skin.
    """
    size = float(np.linalg.norm(landmarks[EYE_OUTER_LEFT] - landmarks[EYE_OUTER_RIGHT]))
    named = np.array([kind_by_name(piece, character) or "" for piece in character.pieces])[head.piece_of]
    component = mesh_components(head)[head.triangles[:, 0]].astype(np.int64)
    kinds = np.where(head.eye_of[head.triangles].min(axis=1) > 0, "eyes", named).astype("<U8")
    lids = landmarks[list({*np.ravel(LEFT_LIDS), *np.ravel(RIGHT_LIDS)})]
    is_card = card_triangles(head.vertices, head.triangles, lids, LASH_REACH * size)
    kinds[(kinds == "") & is_card] = "lashes"
    skin = _skin_pieces(head, kinds, component, landmarks, size)
    is_skin = np.isin(component, skin) & (kinds == "")
    kinds[is_skin] = "skin"
    tree = cKDTree(head.vertices[np.unique(head.triangles[is_skin])])
    for number in np.unique(component[kinds == ""]).tolist():
        rows = np.flatnonzero((component == number) & (kinds == ""))
        used = np.unique(head.triangles[rows])
        is_small = len(rows) < SMALL * is_skin.sum()
        kinds[rows] = _kind_by_place(head.vertices[used], landmarks, size, tree) if is_small else "other"
    return replace(head, kind_of=kinds)


def _skin_pieces(
    head: HeadMesh, kinds: np.ndarray, component: IntArray, landmarks: FloatArray, size: float
) -> IntArray:
    """Numbers of the unnamed connected pieces on which landmarks lie."""
    free = np.flatnonzero(kinds == "")
    known = landmarks[np.isfinite(landmarks[:, 0])]
    if not len(free):
        return np.zeros(0, np.int64)
    middles = head.vertices[head.triangles[free]].mean(axis=1)
    far, near = (np.asarray(found) for found in cKDTree(middles).query(known))
    hit = component[free[near[far < NEAR_SKIN * size * 3]]]
    counts = np.bincount(hit, minlength=int(component.max()) + 1)
    hit = np.flatnonzero(counts >= max(MIN_HITS * counts.sum(), 1))
    # lashes lie under some landmarks, too
    lids = cKDTree(landmarks[list({*np.ravel(LEFT_LIDS), *np.ravel(RIGHT_LIDS)})])
    is_lash = [_is_lash(head.vertices[np.unique(head.triangles[component == number])], lids, size) for number in hit]
    skin: IntArray = hit[~np.array(is_lash, bool)]
    return skin


def card_triangles(places: FloatArray, triangles: IntArray, lids: FloatArray, reach: float) -> Mask:
    """(F,) triangles of cards at lids with landmarks (N, 3) that meet the skin at their roots without a common vertex.

    A piece that a seam of the texture divides from the skin shares all of its border with it; a card shares its root.
    """
    piece = connected_pieces(triangles, len(places))[triangles[:, 0]]
    far, nearest = (np.asarray(found) for found in cKDTree(lids).query(places))
    counts = np.maximum(np.bincount(piece), 1)
    near = np.bincount(piece, (far < reach)[triangles].mean(axis=1)) / counts
    # what lines the lids lies behind their edges
    ahead = np.bincount(piece, (places[:, 2] - lids[nearest, 2])[triangles].mean(axis=1)) / counts
    # edges by their places: those of a border are met once, those that two pieces share by both
    place = np.unique(np.rint(places / reach * PLACES), axis=0, return_inverse=True)[1].reshape(-1)
    edges = np.sort(np.concatenate([place[triangles[:, pair]] for pair in ([0, 1], [1, 2], [2, 0])]), axis=1)
    number = np.unique(edges, axis=0, return_inverse=True)[1].reshape(-1)
    of = np.tile(piece, 3)
    n_met = np.bincount(number)
    owner = np.zeros(len(n_met), np.int64)
    owner[number] = of
    is_shared = np.zeros(len(n_met), bool)
    is_shared[number[owner[number] != of]] = True
    n_free, n_shared = (np.bincount(of[chosen[number]], minlength=len(near)) for chosen in (n_met == 1, is_shared))
    cards: Mask = ((near > NEAR_LIDS) & (ahead > 0) & (n_free > n_shared))[piece]
    return cards


def _is_lash(places: FloatArray, lids: cKDTree, size: float) -> bool:
    return float(np.quantile(np.asarray(lids.query(places)[0]), 0.9)) < LASH_REACH * size


def _kind_by_place(places: FloatArray, landmarks: FloatArray, size: float, skin: cKDTree) -> str:
    """Kind of a small loose piece with these vertices (N, 3)."""
    if _is_lash(places, cKDTree(landmarks[list({*np.ravel(LEFT_LIDS), *np.ravel(RIGHT_LIDS)})]), size):
        return "lashes"
    corners = landmarks[[MOUTH_CORNER_RIGHT, MOUTH_CORNER_LEFT]]
    lips = landmarks[list({*INNER_LIP_UPPER, *INNER_LIP_LOWER})]
    middle = lips.mean(axis=0)
    low, high = places.min(axis=0), places.max(axis=0)
    width = float(abs(corners[0, 0] - corners[1, 0]))
    is_within = max(high[0] - middle[0], middle[0] - low[0]) < MOUTH_WIDTH * width
    is_level = low[1] > middle[1] - MOUTH_HEIGHT * size and high[1] < middle[1] + MOUTH_HEIGHT * size
    is_inside = lips[:, 2].max() - BEHIND * size > high[2] and low[2] > middle[2] - MOUTH_DEPTH * size
    if is_within and is_level and is_inside:
        return "teeth"
    return "skin" if np.median(np.asarray(skin.query(places)[0])) < NEAR_SKIN * size else "other"
