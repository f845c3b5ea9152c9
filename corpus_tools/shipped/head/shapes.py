"""Corrections of MakeHuman's face units: smoother cheeks, stronger brows, lids that slide over the eyeballs."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from corpus_tools.shipped.head.eyes import RECEDE_MM, ball_radius
from corpus_tools.shipped.head.parts import Eyeball
from corpus_tools.shipped.head.skin import HeadSkin
from tts2face.face.deformation import rotation_matrix
from tts2face.numeric.arrays import FloatArray, smoothstep

SMOOTHED_SHAPES = ("mouthSmileLeft", "mouthSmileRight", "mouthDimpleLeft", "mouthDimpleRight", "cheekPuff")
SHAPE_GAINS = {  # brows of MakeHuman hardly rise; its upper lids hardly follow an upward gaze
    "browInnerUp": 2.4,
    "browOuterUpLeft": 1.4,
    "browOuterUpRight": 1.4,
    "eyeLookUpLeft": 1.7,
    "eyeLookUpRight": 1.7,
}
BROW_DOWN = ("browDownLeft", "browDownRight")
# MakeHuman lowers the outer half of a brow most, which is seen as sadness: gain by the distance from the middle, mm.
BROW_X_MM, BROW_GAINS = (8.0, 20.0, 32.0, 48.0), (1.8, 1.25, 0.85, 0.55)
ROUND_SHAPES, N_ROUND_MEANS = ("mouthPucker", "mouthFunnel"), 8  # smoothed above the upper lip, where they crease
LIP_NEAR_MM, LIP_FAR_MM, LIP_TOP = (
    (4.5, 8.0),
    (18.0, 26.0),
    6.60,
)  # distances of that skin from the lips, and its height
N_MEANS = 14  # averages over neighbours; removes folds narrower than about 10 mm
MOUTH = np.array([0.0, 6.585, 1.50])  # on the source's base mesh, its units
UPPER_LIP = np.array([0.0, 6.64, 1.60])
NEAR, FAR = 0.30, 0.46  # distance from the mouth where smoothing begins (lips keep their shape) and is full (cheeks)
BELOW_EYES = 7.10
CLEAR_MM = 0.30  # between lid and eyeball; edges of 2 mm lie below the surface by a tenth of it
STEPS = (0.3, 0.4, 0.5, 0.6, 0.75, 0.9, 1.0)  # weights at which the clearance is computed
LID_SHAPES = ("eyeBlink", "eyeLookDown", "eyeLookUp", "eyeLookIn", "eyeLookOut", "eyeSquint", "eyeWide", "cheekSquint")
N_SPREAD = 4  # edges over which the correction decays


def correct_shapes(skin: HeadSkin) -> HeadSkin:
    """The skin with smoother cheeks and stronger motion of brows and upper lids."""
    means = neighbour_means(skin)
    off = (skin.base - MOUTH) * [0.85, 1.25, 0.6]
    below = smoothstep(skin.base[:, 1], BELOW_EYES, BELOW_EYES - 0.12)
    share = smoothstep(np.linalg.norm(off, axis=1), NEAR, FAR) * below
    shapes = dict(skin.shapes)
    for name in SMOOTHED_SHAPES:
        shapes[name] = smoothed(shapes[name], share, means, N_MEANS)
    for name, factor in SHAPE_GAINS.items():
        shapes[name] = factor * shapes[name]
    for name in BROW_DOWN:
        shapes[name] = np.interp(np.abs(skin.vertices[:, 0]), BROW_X_MM, BROW_GAINS)[:, None] * shapes[name]
    _smooth_rounding(skin, shapes, means)
    return replace(skin, shapes=shapes)


def _smooth_rounding(skin: HeadSkin, shapes: dict[str, FloatArray], means: sparse.csr_array) -> None:
    """Smooth the shapes of rounding on the skin above the upper lip, in place."""
    off = 100.0 * np.linalg.norm((skin.base - UPPER_LIP) * [0.45, 1.0, 0.6], axis=1)
    share = smoothstep(off, *LIP_NEAR_MM) * (1 - smoothstep(off, *LIP_FAR_MM)) * (skin.base[:, 1] > LIP_TOP)
    for name in ROUND_SHAPES:
        shapes[name] = smoothed(shapes[name], share, means, N_ROUND_MEANS)


def smoothed(moved: FloatArray, share: FloatArray, means: sparse.csr_array, number: int) -> FloatArray:
    """A shape (N, 3) after so many averages over neighbours, where its share (N,) is 1."""
    smooth = moved
    for _ in range(number):
        smooth = 0.3 * smooth + 0.7 * (means @ smooth)
    return moved + share[:, None] * (smooth - moved)


def neighbour_means(skin: HeadSkin) -> sparse.csr_array:
    """(N, N) averaging over vertices that share an edge; vertices along a seam count as one."""
    _, weld = np.unique(np.rint(skin.base * 1e6).astype(np.int64), axis=0, return_inverse=True)
    weld = weld.ravel()
    n, m = len(weld), int(weld.max()) + 1
    sides = weld[np.stack([skin.quads, np.roll(skin.quads, -1, axis=1)], axis=-1).reshape(-1, 2)]
    pairs = np.unique(np.concatenate([sides, sides[:, ::-1]]), axis=0)
    adjacency = sparse.csr_array((np.ones(len(pairs)), pairs.T), shape=(m, m))
    first = np.zeros(m, np.int64)
    first[weld] = np.arange(n)
    mean = sparse.csr_array(sparse.diags_array(1.0 / adjacency.sum(axis=1)) @ adjacency).tocoo()
    rows = sparse.csr_array((mean.data, (mean.row, first[mean.col])), shape=(m, n))
    return sparse.csr_array(rows[weld])


def clear_eyeballs(
    skin: HeadSkin,
    balls: tuple[Eyeball, Eyeball],
    names: Sequence[str] = LID_SHAPES,
    clear_mm: float = CLEAR_MM,
    lining: NDArray[np.bool_] | None = None,
) -> HeadSkin:
    """The skin with shapes that keep the lids outside the eyeballs at every weight.

    Parameters
    ----------
    names
        Shapes, without sides, that are corrected.
    clear_mm
        Between lid and eyeball.
    lining : (N,)
        Vertices that are not pushed; None for none.
    """
    means = neighbour_means(skin)
    shapes, corrections = dict(skin.shapes), dict(skin.corrections)
    for ball, side in zip(balls, ("Left", "Right"), strict=True):
        for name in (shape + side for shape in names):
            push = _push(skin.vertices, (shapes[name], clear_mm), ball, name, means)
            if lining is not None:
                push[lining] = 0.0
            shapes[name] = shapes[name] + push
            corrections[name] = push
    return replace(skin, shapes=shapes, corrections=corrections)


def eyeball_overlap(vertices: FloatArray, ball: Eyeball, name: str, weight: float) -> FloatArray:
    """(N,) depth of vertices inside an eyeball in the pose of a shape, mm; negative outside."""
    turn = rotation_matrix(weight * ball.turns.get(name, np.zeros(3)))
    sink = RECEDE_MM * weight if name.startswith("eyeBlink") else 0.0
    off = vertices - ball.centre + [0.0, 0.0, sink]
    distance = np.linalg.norm(off, axis=1)
    angle = np.arccos(np.clip((off @ turn)[:, 2] / distance, -1, 1))
    depth: FloatArray = ball_radius(ball, angle) - distance
    return depth


def _push(
    vertices: FloatArray, shape: tuple[FloatArray, float], ball: Eyeball, name: str, means: sparse.csr_array
) -> FloatArray:
    """(N, 3) displacement that a shape, with its motion and clearance, needs to clear an eyeball."""
    moved, clear_mm = shape
    rest_depth = eyeball_overlap(vertices, ball, "", 0.0)
    is_lid = (rest_depth < 0.1) & (rest_depth > -0.6 * ball.radius) & (vertices[:, 2] > ball.centre[2])
    is_lid &= np.linalg.norm(moved, axis=1) > 0.05
    clear = np.minimum(clear_mm, np.maximum(-rest_depth, 0.0))
    out = vertices + moved - ball.centre
    out = out * [0.8, 0.8, 1.0]
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    length = np.zeros(len(vertices))
    for _ in range(6):
        lacking = np.zeros(len(vertices))
        for weight in STEPS:
            at = vertices + weight * (moved + length[:, None] * out)
            lacking = np.maximum(lacking, (eyeball_overlap(at, ball, name, weight) + clear) / weight)
        length += np.where(is_lid, np.clip(lacking, 0, 4), 0)
    for _ in range(N_SPREAD):
        length = np.maximum(length, 0.9 * (means @ length))
    return length[:, None] * out
