"""The shape of a drawn character: MakeHuman's cage smoothed, and a map of space for rest pose and shapes alike.

Expressions of a drawn character: smiles and squints without creases, and the slight smile at rest.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.ndimage import gaussian_filter1d
from scipy.spatial import cKDTree

from corpus_tools.shipped.drawn.character import Proportions
from corpus_tools.shipped.drawn.eyes import keep_outside
from corpus_tools.shipped.drawn.fields import bump
from corpus_tools.shipped.head.lips import find_lip_line, ring_arcs
from corpus_tools.shipped.head.mesh import SIDES, Cage, Eyeball, build_cage, gaussian_bump
from corpus_tools.shipped.head.shapes import LidEdge, neighbour_means, smoothed
from corpus_tools.shipped.head.skin import HeadSkin
from corpus_tools.shipped.head.source import SourceMesh
from tts2face.numeric.arrays import smoothstep

Floats = NDArray[np.float64]

N_SMOOTHINGS, SHRINK, GROW = 5, 0.65, 0.45  # passes of Taubin's filter, and the weights of its two steps
N_NOSTRIL_MEANS = 14  # fill the nostrils to soft dents
FALLOFF = 2.6  # exponent of `_scale_about`
NOSE, NOSE_REACH_MM, NOSE_UP_MM = np.array([0.0, -36.0, 34.0]), 21.0, 3.0
MOUTH, MOUTH_GAIN, MOUTH_REACH_MM = np.array([0.0, -66.0, 34.0]), -0.06, 30.0
LIP_Y = -64.0
LIP_CORNER_MM = 22.0  # from the middle to the corners of the mouth
NECK_Z = -62.0


def drawn_cage(source: SourceMesh, targets: Mapping[str, float], proportions: Proportions) -> Cage:
    """The cage of a drawn character: `warp(v + u) - warp(v)` for shapes u, so that eyes and lips still meet."""
    cage = smooth_cage(build_cage(source, targets), proportions.drawn)
    eyes = [_eye(cage.vertices, cage, side) for side in SIDES]
    rest = apply_proportions(cage.vertices, eyes, proportions)
    units = {
        name: apply_proportions(cage.vertices + moved, eyes, proportions) - rest for name, moved in cage.units.items()
    }
    middle = np.mean([_eye(rest, cage, side) for side in SIDES], axis=0)
    return replace(cage, vertices=rest - middle, units=units)


def _eye(vertices: Floats, cage: Cage, side: str) -> Floats:
    centre: Floats = vertices[cage.group(f"helper-{side}-eye")].mean(axis=0)
    return centre


def smooth_cage(cage: Cage, strength: float = 1.0) -> Cage:
    """Planes become one surface; eyes, lips, tip of the nose and ears stay. Source: Taubin 1995."""
    means, used = _neighbour_means(cage)
    vertices = cage.vertices.copy()
    share = np.zeros(len(vertices))
    share[used] = SHRINK * strength
    for side in SIDES:
        share *= smoothstep(np.linalg.norm(vertices - _eye(vertices, cage, side), axis=1), 17.0, 27.0)
    share *= smoothstep(np.linalg.norm((vertices - [0, -68, 30]) * [0.75, 1, 0.6], axis=1), 17.0, 26.0)  # mouth
    share *= smoothstep(np.linalg.norm(vertices - [0, -42, 36], axis=1), 9.0, 18.0)  # nose
    share *= 1 - 0.7 * smoothstep(np.abs(vertices[:, 0]), 60.0, 66.0) * (vertices[:, 1] < 30)  # ears
    for _ in range(N_SMOOTHINGS):
        for factor in (1.0, -GROW):
            vertices = vertices + factor * share[:, None] * (means @ vertices - vertices)
    is_used = np.zeros(len(vertices))
    is_used[used] = 1.0
    nostrils = strength * (is_used * gaussian_bump(cage.vertices, (7.5, -45, 26), (7, 6, 9)))[:, None]
    for _ in range(N_NOSTRIL_MEANS):
        vertices = vertices + 0.8 * nostrils * (means @ vertices - vertices)
    return replace(cage, vertices=vertices)


def _neighbour_means(cage: Cage) -> tuple[sparse.csr_array, NDArray[np.int64]]:
    """(N, N) averaging over the vertices of the body that share an edge, and the vertices of the body."""
    quads = cage.source.groups["body"].corners
    sides = np.stack([quads, np.roll(quads, -1, axis=1)], axis=-1).reshape(-1, 2)
    edges = np.unique(np.sort(sides, axis=1), axis=0)
    pairs = np.concatenate([edges, edges[:, ::-1]]).T
    n = len(cage.vertices)
    beside = sparse.csr_array((np.ones(pairs.shape[1]), pairs), shape=(n, n))
    counts = np.maximum(np.asarray(beside.sum(axis=1)).ravel(), 1)
    return sparse.csr_array(sparse.diags_array(1 / counts) @ beside), np.unique(quads)


def apply_proportions(points: Floats, eyes: list[Floats], own: Proportions) -> Floats:
    """Points (N, 3) after a character's map of space; `eyes` are the centres (3,) of the eyes before it."""
    moved: Floats = points.copy()
    for centre in eyes:
        inward = np.array([-0.5 * np.sign(centre[0]), 0.0, -4.0])
        moved = _scale_about(moved, centre + inward, own.eye_gain, own.eye_reach)
    moved = _scale_about(moved, NOSE, own.nose_gain * np.array([1, 1, 1.05]), NOSE_REACH_MM)
    moved[:, 1] += own.drawn * NOSE_UP_MM * bump(moved, (0, -34, 38), (11, 11, 16))
    moved = _scale_about(moved, MOUTH, own.drawn * MOUTH_GAIN, MOUTH_REACH_MM)
    near = bump(moved, (0, LIP_Y, 30), (34, 15, 30))
    moved[:, 1] = LIP_Y + (moved[:, 1] - LIP_Y) * (1 - own.lips_thinner * near)
    moved[:, 2] -= own.lips_back * bump(moved, (0, LIP_Y, 36), (26, 12, 20))
    _shape_jaw(moved, own)
    _shape_cheeks(moved, own)
    near = bump(moved, (0, -60, 24), (34, 13, 26))  # the line between the lips becomes a parabola
    rise = np.minimum((moved[:, 0] / LIP_CORNER_MM) ** 2, 1.3)
    moved[:, 1] += near * (own.corners_up * rise - own.middle_down)
    broad = own.jaw * gaussian_bump(moved, (50, -70, -30), (18, 20, 30))
    moved[:, 0] += np.sign(moved[:, 0]) * broad
    moved[:, 0] *= 1 + 0.03 * own.jaw * bump(moved, (0, -92, 20), (24, 14, 26))
    top = smoothstep(moved[:, 1], -5.0, 80.0)[:, None]
    moved = moved * (1 + top * own.skull_gain * np.array([1, 1, 0.9]))
    moved[:, 2] += own.drawn * 3.0 * bump(moved, (0, 52, 28), (42, 26, 30))  # forehead
    neck = smoothstep(-moved[:, 1], 92.0, 125.0) * (1 - smoothstep(-moved[:, 1], 150.0, 200.0))
    moved[:, 0] *= 1 - own.neck_thinner * neck
    moved[:, 2] = NECK_Z + (moved[:, 2] - NECK_Z) * (1 - 0.73 * own.neck_thinner * neck)
    return moved


def _shape_jaw(points: Floats, own: Proportions) -> None:
    """Taper and shorten the lower face to a small round chin, in place."""
    low = smoothstep(-points[:, 1], 12.0, 108.0)
    front = smoothstep(points[:, 2], -75.0, -10.0)
    points[:, 0] *= 1 - own.jaw_taper * low * (0.45 + 0.55 * front)
    points[:, 1] += own.chin_up * smoothstep(-points[:, 1], 50.0, 112.0)
    points[:, 2] += own.chin_forward * bump(points, (0, -88, 25), (18, 12, 22))


def _shape_cheeks(points: Floats, own: Proportions) -> None:
    """Round and high cheeks, and fat above the jaw, in place."""
    high = gaussian_bump(points, (36, -36, 14), (19, 17, 26))
    points += own.drawn * high[:, None] * np.array([0.0, 1.0, 3.4])
    points[:, 0] += np.sign(points[:, 0]) * own.upper_cheek * high
    low = own.lower_cheek * gaussian_bump(points, (46, -58, -6), (22, 20, 30))
    points[:, 0] += np.sign(points[:, 0]) * low
    points[:, 2] += 0.93 * low


def _scale_about(points: Floats, centre: Floats, gain: float | Floats, reach: float) -> Floats:
    """Points scaled about a centre by 1 + gain (per axis), with a gain that falls off with distance."""
    off = points - centre
    share = np.exp(-((np.linalg.norm(off, axis=1) / reach) ** FALLOFF))
    moved: Floats = centre + off * (1 + share[:, None] * np.asarray(gain))
    return moved


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


def _lip_middle(skin: HeadSkin, ring: NDArray[np.int64]) -> Floats:
    """(3,) middle of the line where lips meet, mm."""
    places = skin.vertices[ring]
    return np.asarray(places[np.abs(places[:, 0]) < LIP_MIDDLE_MM].mean(axis=0))


def _overlap(vertices: Floats, upper: NDArray[np.int64], lower: NDArray[np.int64]) -> Floats:
    """Height in mm by which the lower lip's edge lies above the upper one's, at `COLUMNS_MM`."""
    heights = []
    for arc in (upper, lower):
        order = np.argsort(vertices[arc, 0])
        heights.append(np.interp(COLUMNS_MM, vertices[arc][order, 0], vertices[arc][order, 1]))
    smooth: Floats = gaussian_filter1d(heights[1] - heights[0], 2.0)
    return smooth


def rest_in(skin: HeadSkin, weights: Mapping[str, float], balls: Sequence[Eyeball]) -> HeadSkin:
    """The skin with weights of its shapes (without sides) as the rest pose; blinks still shut."""
    lift = np.zeros_like(skin.vertices)
    for name, weight in weights.items():
        lift += weight * (skin.shapes[f"{name}Left"] + skin.shapes[f"{name}Right"])
    left = 1 - weights.get("eyeBlink", 0.0)
    shapes = {name: left * moved if name.startswith("eyeBlink") else moved for name, moved in skin.shapes.items()}
    return replace(skin, vertices=keep_outside(skin, skin.vertices + lift, balls), shapes=shapes)
