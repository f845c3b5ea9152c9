"""Lashes and brows of a head: each brow moves with the skin under it, each lash turns with the edge of its lid."""

import numpy as np
from scipy.spatial import cKDTree

from tts2face.interchange.characters.transfer.lids import eyeballs
from tts2face.interchange.characters.transfer.parts import triangles_of
from tts2face.interchange.characters.transfer.skin import RINGS, Skin
from tts2face.models.face import Face
from tts2face.numeric.arrays import FloatArray, IntArray, connected_pieces

N_EDGE = 31  # places along the edge of a lid whose motion its lashes take
ROOT_SHARE = 0.3  # of a card's vertices: those nearest to the skin, on which it grows


def move_cards(face: Face, shapes: FloatArray, skin: Skin) -> None:
    """Move lashes and brows in shapes (K, V, 3), in place."""
    for kind in ("lashes", "brows"):
        corners = face.triangles[triangles_of(face, kind)]
        piece = connected_pieces(corners, len(face.vertices)) if len(corners) else np.zeros(0, np.int64)
        used = np.unique(corners)
        for number in np.unique(piece[used]).tolist():
            rows = used[piece[used] == number]
            side, roots = _roots(face, skin, rows)
            if kind == "lashes" and side > 2:
                _turn_with_lid(face, shapes, skin, (rows, side))
            else:
                _follow_skin(face, shapes, skin, (rows, roots))


def _roots(face: Face, skin: Skin, rows: IntArray) -> tuple[int, IntArray]:
    """Lid on which a card grows, as `Skin` numbers them, 0 for none, and those of its vertices that are its roots."""
    candidates = np.flatnonzero(skin.is_seen)
    found = cKDTree(skin.vertices[candidates]).query(face.vertices[rows].astype(np.float64))
    far, near = (np.asarray(values) for values in found)
    is_root = far <= np.quantile(far, ROOT_SHARE)
    return int(np.bincount(skin.side[candidates[near[is_root]]]).argmax()), rows[is_root]


def _follow_skin(face: Face, shapes: FloatArray, skin: Skin, card: tuple[IntArray, IntArray]) -> None:
    """Move each vertex of a card (N,) as the nearest of its roots (M,), and that as the skin under it."""
    rows, roots = card
    places = face.vertices.astype(np.float64)
    grown = skin.rows()[skin.nearest(places[roots])]
    shapes[:, rows] = shapes[:, grown[np.asarray(cKDTree(places[roots]).query(places[rows])[1])]]


def _turn_with_lid(face: Face, shapes: FloatArray, skin: Skin, card: tuple[IntArray, int]) -> None:
    """Move vertices (N,) of a lash with the edge of its lid, turned about the eyeball as far as the edge is.

    A lash that moved as the skin beside it would break: the motion of a lid fades within millimetres of its edge.
    """
    rows, side = card
    line = skin.landmarks[list(RINGS[(side - 1) // 2][(side - 1) % 2])]
    line = line[np.argsort(line[:, 0])]
    x = np.linspace(line[0, 0], line[-1, 0], N_EDGE + 2)[1:-1]
    edge = skin.nearest(np.column_stack([x, *(np.interp(x, line[:, 0], line[:, k]) for k in (1, 2))]), side)
    edge = edge[np.argsort(skin.vertices[edge, 0], kind="stable")]
    at = skin.vertices[edge]
    moves = shapes[:, skin.rows()[edge]]
    places = face.vertices[rows].astype(np.float64)
    root = np.column_stack([places[:, 0], *(np.interp(places[:, 0], at[:, 0], at[:, k]) for k in (1, 2))])
    moved = np.stack([[np.interp(places[:, 0], at[:, 0], move[:, k]) for k in range(3)] for move in moves])
    moved = np.moveaxis(moved, 1, 2)  # (K, N, 3)
    balls = eyeballs(face)
    if balls:
        centre, _ = min(balls, key=lambda ball: float(np.linalg.norm(ball[0] - at.mean(axis=0))))
        before, after = root - centre, root + moved - centre
        turn = np.arctan2(after[..., 1], after[..., 2]) - np.arctan2(before[:, 1], before[:, 2])
        apart = places - root
        height, depth = apart[:, 1], apart[:, 2]
        # about the axis from eye to eye
        moved[..., 1] += (np.cos(turn) - 1) * height + np.sin(turn) * depth
        moved[..., 2] += (np.cos(turn) - 1) * depth - np.sin(turn) * height
    shapes[:, rows] = moved
