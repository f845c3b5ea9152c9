"""Lids that slide over the eyeball: shapes are straight lines and would cut through it half way."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from corpus_tools.head.eyes import RECEDE_MM, ball_radius
from corpus_tools.head.piece import Ball
from corpus_tools.head.shapes import neighbours
from corpus_tools.head.skin import Skin
from tts2face.face.deformation import rotation_matrix

Floats = NDArray[np.float64]

CLEAR_MM = 0.30  # between lid and ball; edges between vertices 2 mm apart sag by a tenth of it
STEPS = (0.3, 0.4, 0.5, 0.6, 0.75, 0.9, 1.0)  # weights at which the lids are measured
LID_SHAPES = ("eyeBlink", "eyeLookDown", "eyeLookUp", "eyeLookIn", "eyeLookOut", "eyeSquint", "eyeWide", "cheekSquint")
N_SPREAD = 4  # edges over which a push fades


def cleared(skin: Skin, balls: tuple[Ball, Ball]) -> Skin:
    """The skin with shapes that keep the lids outside the balls at every weight."""
    beside = neighbours(skin)
    shapes, mended = dict(skin.shapes), dict(skin.mended)
    for ball, side in zip(balls, ("Left", "Right"), strict=True):
        for name in (shape + side for shape in LID_SHAPES):
            push = _push(skin.vertices, shapes[name], ball, name, beside)
            shapes[name] = shapes[name] + push
            mended[name] = push
    return replace(skin, shapes=shapes, mended=mended)


def overlap(vertices: Floats, ball: Ball, name: str, weight: float) -> Floats:
    """(N,) how deep vertices lie within a ball that is turned and sunk as a shape does; negative outside, mm."""
    turn = rotation_matrix(weight * ball.turns.get(name, np.zeros(3)))
    sink = RECEDE_MM * weight if name.startswith("eyeBlink") else 0.0
    off = vertices - ball.centre + [0.0, 0.0, sink]
    distance = np.linalg.norm(off, axis=1)
    angle = np.arccos(np.clip((off @ turn)[:, 2] / distance, -1, 1))
    depth: Floats = ball_radius(ball, angle) - distance
    return depth


def _push(vertices: Floats, moved: Floats, ball: Ball, name: str, beside: sparse.csr_array) -> Floats:
    """(N, 3) what a shape lacks to keep clear of a ball."""
    rest_depth = overlap(vertices, ball, "", 0.0)
    is_lid = (rest_depth < 0.1) & (rest_depth > -0.6 * ball.radius) & (vertices[:, 2] > ball.centre[2])
    is_lid &= np.linalg.norm(moved, axis=1) > 0.05
    clear = np.minimum(CLEAR_MM, np.maximum(-rest_depth, 0.0))
    out = vertices + moved - ball.centre
    out = out * [0.8, 0.8, 1.0]
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    length = np.zeros(len(vertices))
    for _ in range(6):
        lacking = np.zeros(len(vertices))
        for weight in STEPS:
            at = vertices + weight * (moved + length[:, None] * out)
            lacking = np.maximum(lacking, (overlap(at, ball, name, weight) + clear) / weight)
        length += np.where(is_lid, np.clip(lacking, 0, 4), 0)
    for _ in range(N_SPREAD):
        length = np.maximum(length, 0.9 * (beside @ length))
    return length[:, None] * out
