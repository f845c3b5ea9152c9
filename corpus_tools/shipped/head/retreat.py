"""Lower teeth and gums that retreat where an open jaw, a smile or rounded lips would show them through the chin."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from corpus_tools.shipped.head.lips import ring_arcs
from corpus_tools.shipped.head.skin import HeadSkin
from corpus_tools.shipped.head.subdivision import triangulate
from tts2face.numeric.arrays import FloatArray

COVER_MM = (
    2.4  # of skin ahead of teeth and gums below the lip, for all people, whose shapes are those of the default one
)
CROWN_MM = 3.0  # half the size of a crown: it retreats as a whole
BELOW_LIP_MM = 1.0  # what is higher than this below the edge of the lower lip is seen in the open mouth
LARGEST_MM = 8.0
OPENINGS = (0.5, 0.7, 0.85, 1.0)  # weights of jawOpen with which a smile is corrected
SMILES = ("mouthSmileLeft", "mouthSmileRight")
ROUNDED = {"mouthPucker": 1.0, "mouthShrugLower": 0.8}  # of a rounded vowel, beside an open jaw
BACKWARDS = np.array([0.0, 0.0, -1.0])


def add_retreat(
    points: FloatArray, shapes: Mapping[str, FloatArray], skin: HeadSkin, lips: NDArray[np.int64]
) -> dict[str, FloatArray]:
    """Shapes of the lower arch (N, 3) that stays behind the skin with an open jaw, a smile and in a rounded vowel.

    Parameters
    ----------
    shapes
        Motion (N, 3) of the arch with the jaw.
    lips
        The ring of vertices where the lips meet.
    """
    moved = dict(shapes)
    lower = ring_arcs(skin, lips)[1]

    def lacking(opening: float, lips_pose: Mapping[str, float]) -> FloatArray:
        """(N,) mm by which vertices must retreat in a pose."""
        moving = (weight * skin.shapes[name] for name, weight in lips_pose.items())
        posed = sum(moving, skin.vertices + opening * skin.shapes["jawOpen"])
        place = points + opening * moved["jawOpen"]
        return lacking_cover(place, posed, triangulate(skin.quads), lower) * (points[:, 2] > 0)

    beside = cKDTree(points[:, [0, 2]]).query_ball_point(points[:, [0, 2]], CROWN_MM)

    def whole(depth: FloatArray) -> FloatArray:
        """(N,) largest retreat of the vertices above, below and beside each one."""
        return np.array([depth[near].max() for near in beside])

    moved["jawOpen"] = moved["jawOpen"] + np.outer(whole(lacking(1.0, {})), BACKWARDS)
    smile = dict.fromkeys(SMILES, 1.0)
    most = whole(np.max([lacking(opening, smile) for opening in OPENINGS], axis=0))
    for name in SMILES:
        is_own = points[:, 0] > 0 if name.endswith("Left") else points[:, 0] <= 0
        moved[name] = np.outer(most * is_own, BACKWARDS)
    rounded = whole(np.max([lacking(opening, ROUNDED) for opening in OPENINGS], axis=0))
    moved["mouthPucker"] = np.outer(rounded, BACKWARDS)
    return moved


def lacking_cover(
    places: FloatArray, skin: FloatArray, triangles: NDArray[np.int64], lower_lip: NDArray[np.int64]
) -> FloatArray:
    """(N,) mm by which places (N, 3) below the edge of a lower lip must retreat to be covered by the skin (V, 3)."""
    line = skin[lower_lip][np.argsort(skin[lower_lip, 0])]
    is_below = places[:, 1] < np.interp(places[:, 0], line[:, 0], line[:, 1]) - BELOW_LIP_MM
    depth = places[:, 2] - front_depth(places[:, :2], skin, triangles) + COVER_MM
    return np.where(is_below, np.clip(depth, 0.0, LARGEST_MM), 0.0)


def front_depth(places: FloatArray, vertices: FloatArray, triangles: NDArray[np.int64]) -> FloatArray:
    """(N,) z of the foremost point of a surface at places (N, 2) of x and y; infinite where there is none."""
    corners = vertices[triangles]
    low, high = places.min(axis=0), places.max(axis=0)
    flat = corners[:, :, :2]
    near = ((flat.max(axis=1) > low) & (flat.min(axis=1) < high)).all(axis=1)
    a, b, c = corners[near].transpose(1, 0, 2)
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (c[:, 0] - a[:, 0]) * (b[:, 1] - a[:, 1])
    area = np.where(np.abs(area) < 1e-9, np.inf, area)
    front = np.full(len(places), np.inf)
    for number, (x, y) in enumerate(places):
        second = ((x - a[:, 0]) * (c[:, 1] - a[:, 1]) - (c[:, 0] - a[:, 0]) * (y - a[:, 1])) / area
        third = ((b[:, 0] - a[:, 0]) * (y - a[:, 1]) - (x - a[:, 0]) * (b[:, 1] - a[:, 1])) / area
        inside = (second >= 0) & (third >= 0) & (second + third <= 1)
        if inside.any():
            front[number] = (a[:, 2] + second * (b - a)[:, 2] + third * (c - a)[:, 2])[inside].max()
    return front
