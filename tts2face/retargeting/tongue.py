"""Tip of the tongue between the teeth or behind the upper incisors, by a face's own geometry."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tts2face.models.face import Face
from tts2face.numeric import ordered_product, smoothstep

FloatArray = NDArray[np.float64]

TONGUE_OUT, TONGUE_UP = "tongueOut", "tongueUp"
TIP_SHARE = 0.9  # of the largest displacement by a shape: vertices that move more are the tip
# Relative to the mouth's width: the tip ends before the edge of the upper incisors, or is seen below it.
OUT_BEFORE_EDGE, UP_BELOW_EDGE = 0.005, 0.065
LARGEST_OUT, LARGEST_UP = 0.5, 0.9
OUT_GAPS = (
    0.01,
    0.06,
)  # gap of the lips over the mouth's width, below which the tip stays in, and from which it is out


@dataclass(frozen=True, slots=True, eq=False)
class TongueTip:
    """One shape that brings the tip of the tongue to its target.

    Parameters
    ----------
    shape
        Index of the shape.
    motion : (K,)
        Motion of the tip along one axis per weight, mm.
    missing
        Distance from the tip at rest to its target along this axis, mm.
    largest
        Upper limit of the weight.
    """

    shape: int
    motion: FloatArray
    missing: float
    largest: float

    def weights(self, speech: FloatArray) -> FloatArray:
        """Weights (T,) with which the tip reaches its target in speech (T, K)."""
        others = self.motion.copy()
        others[self.shape] = 0.0
        missing = self.missing - ordered_product(speech, others)
        return np.asarray(np.clip(missing / self.motion[self.shape], 0.0, self.largest), np.float64)


@dataclass(frozen=True, slots=True, eq=False)
class Tongue:
    """Shapes of the tongue that a face has, None for the others; `rest_width` is that of the mouth, mm."""

    out: TongueTip | None
    up: TongueTip | None
    rest_width: float

    def move(self, speech: FloatArray, gap: FloatArray, tracks: Mapping[str, FloatArray]) -> FloatArray:
        """Speech (T, K) with the shapes of the tongue; `gap` (T,) is that of the lips, mm."""
        values = speech.copy()
        if self.out is not None:
            parted = smoothstep(gap / self.rest_width, *OUT_GAPS)
            values[:, self.out.shape] = tracks["tongue_out"] * parted * self.out.weights(speech)
        if self.up is not None:
            values[:, self.up.shape] = tracks["tongue_up"] * self.up.weights(speech)
        return values


def build_tongue(face: Face, edge: tuple[float, float], rest_width: float) -> Tongue:
    """Tongue of a face; `edge` is the height and depth of the upper incisors' edge, mm."""
    height, depth = edge
    return Tongue(
        _tip(face, TONGUE_OUT, 2, depth + OUT_BEFORE_EDGE * rest_width, LARGEST_OUT),
        _tip(face, TONGUE_UP, 1, height - UP_BELOW_EDGE * rest_width, LARGEST_UP),
        rest_width,
    )


def _tip(face: Face, name: str, axis: int, target: float, largest: float) -> TongueTip | None:
    """Tip of the tongue as a shape moves it along an axis; None for a face without such a shape."""
    if name not in face.shape_names:
        return None
    shape = face.shape_names.index(name)
    moved = np.linalg.norm(face.shapes[shape], axis=1)
    tip = np.flatnonzero(moved > TIP_SHARE * moved.max()) if moved.max() > 0 else np.zeros(0, np.int64)
    if not len(tip):
        return None
    motion = face.shapes[:, tip, axis].astype(np.float64).mean(axis=1)
    places = face.vertices[tip, axis].astype(np.float64)
    at = float(places.max() if axis == 2 else places.mean())
    return TongueTip(shape, motion, target - at, largest) if motion[shape] > 0 else None
