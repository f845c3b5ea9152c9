"""Contact of the lower lip with the upper incisors in labiodentals.

Tip of the tongue between the teeth or behind the upper incisors, by a face's own geometry.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tts2face.face.lip_constraints import LipConstraints
from tts2face.models.face import WIDE_OPEN, Face
from tts2face.models.landmarks import INNER_LIP_LOWER, INNER_LIP_UPPER, UPPER_LIP_INNER_MID
from tts2face.numeric.arrays import FloatArray, ordered_product, smoothstep
from tts2face.numeric.least_squares import bounded_least_squares

TOUCHING_LANDMARKS, FACING_LANDMARKS = INNER_LIP_LOWER[4:7], INNER_LIP_UPPER[4:7]  # of the lips, about the middle
CONTACT_WEIGHT = 1e4  # of a coordinate of these landmarks, relative to a landmark of the cheek
# The jaw rises in labiodentals, and a lip that is rolled in far is a flat, pale band: shares of the weights in speech
# that are preferred, and cost of the roll relative to the median curvature.
ROLLED = "mouthRollLower"
KEPT_SHARES = {WIDE_OPEN: 0.4, "mouthClose": 0.4, ROLLED: 0.0}
ROLL_COST = 1.0
# Shapes that pull the lip by its corners where nothing rolls it: a labiodental is no grin, and no frown.
GRIN, GRIN_COST = ("mouthSmile", "mouthDimple", "mouthStretch", "mouthFrown"), 20.0
TEETH_NAMES = ("teeth", "tooth")  # in the names of parts
INCISOR_SHARE = 0.08  # of the mouth's width: half the width of the middle incisors
STILL_SHARE = 0.1  # of the largest motion of the jaw: upper teeth move less
FRONT_SHARE, EDGE_SHARE = 0.06, 0.01  # of the mouth's width: depth of the front teeth, and height of their edge
# Incisors of a face without teeth, or whose teeth are elsewhere, relative to the middle of the upper lip and to the
# mouth's width: as on the default head.
EDGE_BELOW_LIP, EDGE_BEHIND_LIP = 0.055, 0.085
PLAUSIBLE_BELOW, PLAUSIBLE_BEHIND = (-0.02, 0.14), (-0.02, 0.3)
SHOWN_SHARE = 0.03  # of the mouth's width: least distance of the upper lip, which shows the teeth
COVER_SHARE, AHEAD_SHARE = 0.03, 0.012  # of the mouth's width, by which the lip covers the edge and lies before it
TONGUE_OUT, TONGUE_UP = "tongueOut", "tongueUp"
TIP_SHARE = 0.9  # of the largest displacement by a shape: vertices that move more are the tip
# Relative to the mouth's width: the tip ends before the edge of the upper incisors, and is seen below it.
OUT_BEFORE_EDGE, OUT_BELOW_EDGE = 0.04, 0.02
UP_BELOW_EDGE = 0.065
LARGEST_OUT, LARGEST_UP = 0.5, 0.9
OUT_GAPS = (
    0.01,
    0.06,
)  # gap of the lips over the mouth's width, below which the tip stays in, and from which it is out


@dataclass(frozen=True, slots=True, eq=False)
class IncisorContact:
    """Linear motion of the lower lip, and where it touches the upper incisors; built by `build_incisor_contact`.

    Parameters
    ----------
    mouth
        Shapes that move the lip, their limits, and the cost of changes.
    motion : (r, K)
        Height and depth of the touching landmarks per weight, mm.
    target : (r,)
        Their displacement from rest in contact, mm.
    upper_motion : (u, K)
        Height of the facing landmarks of the upper lip per weight, mm.
    upper_target : (u,)
        Their least displacement from rest in contact, mm.
    kept, cost : (k,)
        Share of each shape's weight in speech that is preferred in contact, and the cost of other weights.
    """

    mouth: LipConstraints
    motion: FloatArray
    target: FloatArray
    upper_motion: FloatArray
    upper_target: FloatArray
    kept: FloatArray
    cost: FloatArray

    def enforce(self, speech: FloatArray, contact: FloatArray) -> FloatArray:
        """Weights (T, K) whose lower lip is in contact by shares (T,): 0 as in speech, 1 at the incisors."""
        changed = contact > 0
        if not changed.any():
            return speech
        mouth, lips = self.mouth, np.concatenate([self.motion, self.upper_motion])
        moved, now = lips[:, self.mouth.moving], ordered_product(speech[changed], lips.T)
        n_lower = len(self.motion)
        wanted_now = np.maximum(self.upper_target, now[:, n_lower:])
        wanted_now = np.concatenate([np.broadcast_to(self.target, (len(now), n_lower)), wanted_now], axis=1)
        shift = contact[changed, None] * (wanted_now - now)
        current = speech[np.ix_(changed, mouth.moving)]
        wanted = ordered_product(current, moved.T) + shift
        share = contact[changed, None]
        preferred = current * (1.0 - share * (1.0 - self.kept))
        cost = share * self.cost
        curvature = mouth.curvature + CONTACT_WEIGHT * ordered_product(moved.T, moved)
        linear = ordered_product(preferred, mouth.curvature) + CONTACT_WEIGHT * ordered_product(wanted, moved)
        values = speech.copy()
        values[np.ix_(changed, mouth.moving)] = bounded_least_squares(
            curvature + cost[:, :, None] * np.eye(cost.shape[1]), linear + cost * preferred, mouth.limits
        )
        return values


def build_incisor_contact(
    shape_names: tuple[str, ...],
    mouth: LipConstraints,
    edge: tuple[float, float],
    *,
    places: FloatArray,
    motion: FloatArray,
    width: float,
) -> IncisorContact:
    """Contact of a face with given shapes, for incisors whose edge is at a height and depth, mm.

    Parameters
    ----------
    places, motion : (478, 3), (478, 3, K)
        Landmarks of the face, and their motion per weight, mm.
    width
        Width of the mouth at rest, mm.
    """
    names = [shape_names[at] for at in mouth.moving]
    lips = list(TOUCHING_LANDMARKS)
    target = np.array([edge[0] + COVER_SHARE * width, edge[1] + AHEAD_SHARE * width]) - places[lips, 1:]
    upper = list(FACING_LANDMARKS)
    costs = {ROLLED: ROLL_COST} if ROLLED in names else {name: GRIN_COST for name in names if name.startswith(GRIN)}
    return IncisorContact(
        mouth=mouth,
        motion=motion[lips, 1:].reshape(2 * len(lips), -1),
        target=target.ravel(),
        upper_motion=motion[upper, 1],
        upper_target=edge[0] + (COVER_SHARE + SHOWN_SHARE) * width - places[upper, 1],
        kept=np.array([KEPT_SHARES.get(name, 1.0) for name in names]),
        cost=np.array([costs.get(name, 0.0) for name in names]) * np.median(np.diag(mouth.curvature)),
    )


def incisor_edge(face: Face, places: FloatArray, width: float) -> tuple[float, float]:
    """Height and depth of the upper incisors' edge, mm: that of its teeth, or where the default head has them.

    Parameters
    ----------
    places : (478, 3)
        Landmarks of the face; NaN for missing ones.
    width
        Width of the mouth, mm.
    """
    lip = places[UPPER_LIP_INNER_MID]
    points = upper_teeth(face)
    front = points[np.abs(points[:, 0] - lip[0]) < INCISOR_SHARE * width]
    if len(front):
        front = front[front[:, 2] > front[:, 2].max() - FRONT_SHARE * width]
        low = float(front[:, 1].min())
        ahead = float(front[front[:, 1] < low + EDGE_SHARE * width, 2].max())
        below, behind = (lip[1] - low) / width, (lip[2] - ahead) / width
        if ROLLED not in face.shape_names:
            # a lip that nothing rolls in does not reach teeth that lie deep in the mouth
            ahead, behind = lip[2] - min(behind, EDGE_BEHIND_LIP) * width, min(behind, EDGE_BEHIND_LIP)
        # parts named "teeth" of strangers' characters may be a whole jaw, or lie elsewhere
        if PLAUSIBLE_BELOW[0] < below < PLAUSIBLE_BELOW[1] and PLAUSIBLE_BEHIND[0] < behind < PLAUSIBLE_BEHIND[1]:
            return low, ahead
    return float(lip[1] - EDGE_BELOW_LIP * width), float(lip[2] - EDGE_BEHIND_LIP * width)


def upper_teeth(face: Face) -> FloatArray:
    """Vertices (N, 3) of the parts named as teeth that the jaw does not move; none on a face without teeth."""
    parts = [part for part in face.parts if any(name in part.name.lower() for name in TEETH_NAMES)]
    used = [face.triangles[part.first : part.first + part.count].ravel() for part in parts]
    numbers = np.unique(np.concatenate([np.zeros(0, np.int32), *used]))
    if face.opening is not None and len(numbers):
        jaw = np.linalg.norm(face.shapes[face.opening], axis=1)
        numbers = numbers[jaw[numbers] < STILL_SHARE * jaw.max()]
    return np.asarray(face.vertices[numbers], np.float64)


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
    """Shapes of the tongue that a face has, None for the others; `rest_width` is that of the mouth, mm.

    ``between`` lifts the tip that is put out between the teeth, over the lower lip.
    """

    out: TongueTip | None
    between: TongueTip | None
    up: TongueTip | None
    rest_width: float

    def move(self, speech: FloatArray, gap: FloatArray, tracks: Mapping[str, FloatArray]) -> FloatArray:
        """Speech (T, K) with the shapes of the tongue; `gap` (T,) is that of the lips, mm."""
        values = speech.copy()
        if self.out is not None:
            parted = smoothstep(gap / self.rest_width, *OUT_GAPS)
            out = tracks["tongue_out"] * parted
            values[:, self.out.shape] = out * self.out.weights(speech)
            if self.between is not None:
                values[:, self.between.shape] = out * self.between.weights(values)
        if self.up is not None:
            up = tracks["tongue_up"] * self.up.weights(speech)
            values[:, self.up.shape] = np.maximum(values[:, self.up.shape], up)
        return values


def build_tongue(face: Face, edge: tuple[float, float], rest_width: float) -> Tongue:
    """Tongue of a face; `edge` is the height and depth of the upper incisors' edge, mm."""
    height, depth = edge
    return Tongue(
        _tip(face, TONGUE_OUT, 2, depth + OUT_BEFORE_EDGE * rest_width, LARGEST_OUT),
        _tip(face, TONGUE_UP, 1, height - OUT_BELOW_EDGE * rest_width, LARGEST_UP),
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
