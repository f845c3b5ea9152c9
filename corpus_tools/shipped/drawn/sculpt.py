"""The shape of a drawn character: MakeHuman's cage smoothed, and a map of space for rest pose and shapes alike."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from corpus_tools.shipped.drawn.character import Proportions
from corpus_tools.shipped.drawn.fields import bump
from corpus_tools.shipped.head.cage import SIDES, Cage, build_cage
from corpus_tools.shipped.head.noise import gaussian_bump
from corpus_tools.shipped.head.source import SourceMesh
from tts2face.numeric.arrays import FloatArray, smoothstep

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


def _eye(vertices: FloatArray, cage: Cage, side: str) -> FloatArray:
    centre: FloatArray = vertices[cage.group(f"helper-{side}-eye")].mean(axis=0)
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


def apply_proportions(points: FloatArray, eyes: list[FloatArray], own: Proportions) -> FloatArray:
    """Points (N, 3) after a character's map of space; `eyes` are the centres (3,) of the eyes before it."""
    moved: FloatArray = points.copy()
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


def _shape_jaw(points: FloatArray, own: Proportions) -> None:
    """Taper and shorten the lower face to a small round chin, in place."""
    low = smoothstep(-points[:, 1], 12.0, 108.0)
    front = smoothstep(points[:, 2], -75.0, -10.0)
    points[:, 0] *= 1 - own.jaw_taper * low * (0.45 + 0.55 * front)
    points[:, 1] += own.chin_up * smoothstep(-points[:, 1], 50.0, 112.0)
    points[:, 2] += own.chin_forward * bump(points, (0, -88, 25), (18, 12, 22))


def _shape_cheeks(points: FloatArray, own: Proportions) -> None:
    """Round and high cheeks, and fat above the jaw, in place."""
    high = gaussian_bump(points, (36, -36, 14), (19, 17, 26))
    points += own.drawn * high[:, None] * np.array([0.0, 1.0, 3.4])
    points[:, 0] += np.sign(points[:, 0]) * own.upper_cheek * high
    low = own.lower_cheek * gaussian_bump(points, (46, -58, -6), (22, 20, 30))
    points[:, 0] += np.sign(points[:, 0]) * low
    points[:, 2] += 0.93 * low


def _scale_about(points: FloatArray, centre: FloatArray, gain: float | FloatArray, reach: float) -> FloatArray:
    """Points scaled about a centre by 1 + gain (per axis), with a gain that falls off with distance."""
    off = points - centre
    share = np.exp(-((np.linalg.norm(off, axis=1) / reach) ** FALLOFF))
    moved: FloatArray = centre + off * (1 + share[:, None] * np.asarray(gain))
    return moved
