"""Expressions of a drawn character: smiles and squints without creases, and the slight smile at rest."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d
from scipy.spatial import cKDTree

from corpus_tools.shipped.drawn.fields import bump
from corpus_tools.shipped.drawn.lids import keep_outside
from corpus_tools.shipped.head.lid_edges import LidEdge
from corpus_tools.shipped.head.lips import find_lip_line, ring_arcs
from corpus_tools.shipped.head.parts import Eyeball
from corpus_tools.shipped.head.shapes import neighbour_means, smoothed
from corpus_tools.shipped.head.skin import HeadSkin
from tts2face.numeric.arrays import FloatArray, smoothstep

MOUTH_SIDES = (("Left", 1.0), ("Right", -1.0))
SMILES, N_SMILE_MEANS = ("mouthSmile", "mouthDimple", "mouthStretch", "noseSneer", "mouthUpperUp"), 120
SQUINTS, N_SQUINT_MEANS = ("eyeSquint", "cheekSquint"), 30
LID_MM, MOUTH_MM = (1.5, 7.0), (13.0, 20.0)  # distances over which the smoothing begins
SHUT_SIDES, SHUT_SHAPES = ("mouthSmile", "mouthDimple", "mouthPress"), ("mouthPucker", "mouthFunnel")
LIP_TOUCH_MM, LIP_REACH_MM, LIP_MIDDLE_MM = 0.3, 9.0, 8.0  # overlap that is left, reach of its removal, between sides
LIFTS = ("mouthUpperUp", "mouthSmile", "mouthShrugUpper")
LIP_TOP_MM, LIP_TOP_SIZE = np.array([0.0, 10.0, 4.0]), (32.0, 11.5, 24.0)
COLUMNS_MM = np.linspace(-30.0, 30.0, 61)  # across the mouth
# A smile lifts corners and cheeks more than MakeHuman's, and the middle of both lips, which else hangs like a beak.
CORNER_MM, CHEEK_MM, MIDDLE_MM = np.array([1.5, 3.0, 1.5]), np.array([1.0, 1.6, 2.6]), np.array([0.0, 1.2, -0.6])


def soften(skin: HeadSkin, lids: Sequence[LidEdge], ring: NDArray[np.int64]) -> HeadSkin:
    """Smiles and squints whose motion of the cheeks is one smooth field; a smile lifts round cheeks.

    `ring` is where the lips meet.
    """
    means, shapes, places = neighbour_means(skin), dict(skin.shapes), skin.vertices
    x, y, z = _lip_middle(skin, ring)
    width = float(np.ptp(places[ring, 0])) / 2
    rims = np.concatenate([places[np.concatenate([edge.upper, edge.lower])] for edge in lids])
    off_lids = smoothstep(np.asarray(cKDTree(rims).query(places)[0]), *LID_MM)
    off_mouth = smoothstep(np.linalg.norm((places - [x, y, z - 2]) * [0.80, 1.25, 0.5], axis=1), *MOUTH_MM)
    for names, share, n_means in ((SMILES, off_mouth * off_lids, N_SMILE_MEANS), (SQUINTS, off_lids, N_SQUINT_MEANS)):
        for name in (stem + side for stem in names for side, _ in MOUTH_SIDES):
            shapes[name] = smoothed(shapes[name], share, means, n_means)
    for side, sign in MOUTH_SIDES:
        outward = np.array([sign, 1.0, 1.0])
        corner = bump(places, (sign * (width + 2.5), y + 1.6, z - 6), (11, 9, 20))
        cheek = bump(places, (sign * 37, -32, 18), (17, 14, 24)) * off_lids
        middle = bump(places, (x, y, z + 2), (13, 6, 24))
        lift = corner[:, None] * outward * CORNER_MM + cheek[:, None] * outward * CHEEK_MM
        lift += middle[:, None] * MIDDLE_MM / len(MOUTH_SIDES)
        shapes[f"mouthSmile{side}"] = shapes[f"mouthSmile{side}"] + lift
    return replace(skin, shapes=shapes)


def part_lips(skin: HeadSkin, ring: NDArray[np.int64]) -> HeadSkin:
    """Smiles and rounding whose lips touch and do not run into each other; `ring` is where they meet."""
    line, shapes = find_lip_line(skin, ring), dict(skin.shapes)
    upper, lower = ring_arcs(skin, ring)
    apart = _overlap(skin.vertices, upper, lower)
    near = np.exp(-((np.asarray(cKDTree(skin.vertices[ring]).query(skin.vertices)[0]) / LIP_REACH_MM) ** 2))
    places = skin.vertices[:, 0]
    left = smoothstep(places, -LIP_MIDDLE_MM, LIP_MIDDLE_MM)
    groups = [{name: np.ones_like(places)} for name in SHUT_SHAPES]
    groups += [{f"{stem}Left": left, f"{stem}Right": 1 - left} for stem in SHUT_SIDES]  # both sides move together
    for shares in groups:
        moved = np.sum([shapes[name] for name in shares], axis=0)
        more = np.clip(_overlap(skin.vertices + moved, upper, lower) - apart - LIP_TOUCH_MM, 0, None)
        lift = np.interp(places, COLUMNS_MM, more) * near * -line.lower / 2
        for name, share in shares.items():
            shapes[name] = shapes[name] + (share * lift)[:, None] * [0, 1, 0]
    return replace(skin, shapes=shapes)


def round_lips(skin: HeadSkin, gain: float) -> HeadSkin:
    """The skin with `mouthPucker` times a gain."""
    return replace(skin, shapes={**skin.shapes, "mouthPucker": gain * skin.shapes["mouthPucker"]})


def thin_lips(skin: HeadSkin, ring: NDArray[np.int64], still: float) -> HeadSkin:
    """Lifted upper lips that become thinner: the skin between them and the nose, which is short, would fold.

    The top of the lip does not follow the share `still` of a lift.
    """
    share = 1 - still * bump(skin.vertices, _lip_middle(skin, ring) + LIP_TOP_MM, LIP_TOP_SIZE)
    lifted = {
        name: moved * np.stack([np.ones_like(share), share, np.ones_like(share)], axis=1)
        for name, moved in skin.shapes.items()
        if name.startswith(LIFTS)
    }
    return replace(skin, shapes={**skin.shapes, **lifted})


def close_jaw(skin: HeadSkin, ring: NDArray[np.int64]) -> HeadSkin:
    """A `mouthClose` that undoes the gap of an open jaw: proportions change how far the jaw parts the lips."""
    upper, lower = ring_arcs(skin, ring)
    places, jaw, close = skin.vertices, skin.shapes["jawOpen"], skin.shapes["mouthClose"]
    open_, closed = (-_overlap(places + moved, upper, lower) for moved in (jaw, jaw + close))
    inside = np.abs(COLUMNS_MM) < LIP_MIDDLE_MM
    gain = float(np.median(open_[inside] / (open_ - closed)[inside]))
    return replace(skin, shapes={**skin.shapes, "mouthClose": gain * close})


def _lip_middle(skin: HeadSkin, ring: NDArray[np.int64]) -> FloatArray:
    """(3,) middle of the line where lips meet, mm."""
    places = skin.vertices[ring]
    return np.asarray(places[np.abs(places[:, 0]) < LIP_MIDDLE_MM].mean(axis=0))


def _overlap(vertices: FloatArray, upper: NDArray[np.int64], lower: NDArray[np.int64]) -> FloatArray:
    """Height in mm by which the lower lip's edge lies above the upper one's, at `COLUMNS_MM`."""
    heights = []
    for arc in (upper, lower):
        order = np.argsort(vertices[arc, 0])
        heights.append(np.interp(COLUMNS_MM, vertices[arc][order, 0], vertices[arc][order, 1]))
    smooth: FloatArray = gaussian_filter1d(heights[1] - heights[0], 2.0)
    return smooth


def rest_in(skin: HeadSkin, weights: Mapping[str, float], balls: Sequence[Eyeball]) -> HeadSkin:
    """The skin with weights of its shapes (without sides) as the rest pose; blinks still shut."""
    lift = np.zeros_like(skin.vertices)
    for name, weight in weights.items():
        lift += weight * (skin.shapes[f"{name}Left"] + skin.shapes[f"{name}Right"])
    left = 1 - weights.get("eyeBlink", 0.0)
    shapes = {name: left * moved if name.startswith("eyeBlink") else moved for name, moved in skin.shapes.items()}
    return replace(skin, vertices=keep_outside(skin, skin.vertices + lift, balls), shapes=shapes)
