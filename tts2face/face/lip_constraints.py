"""Lip constraints for gestures added to speech: closed lips stay closed and lips never cross.

Ju and Lee 2008, section 7, warn that an expression with an open mouth opens plosives. Here the gaps between the lips
are target values of the least-squares problem that combines an expression with speech.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tts2face.face.landmarks import landmark_motion, scatter_landmarks
from tts2face.face.mouth import mouth_curvature, require_lips
from tts2face.models.face import Face
from tts2face.models.landmarks import (
    INNER_LIP_LOWER,
    INNER_LIP_UPPER,
    MOUTH_CORNER_LEFT,
    MOUTH_CORNER_RIGHT,
    MOUTH_REGION,
    UPPER_LIP_INNER_MID,
)
from tts2face.numeric.arrays import FloatArray, ordered_product, smoothstep
from tts2face.numeric.least_squares import bounded_least_squares

SPEECH_SHAPE_PREFIXES = ("jaw", "mouth")  # name prefixes of the shapes that speech moves
MIDDLE_PAIR = INNER_LIP_UPPER.index(UPPER_LIP_INNER_MID)
FULL_EXPRESSION_GAP_MM = 4.0  # gap from which lips follow an expression in full; touching lips do not follow it
MIN_GAP_SHARE = 0.5  # least share of the speech gap that an expression leaves open
GAP_CONSTRAINT_WEIGHT = 1e5  # relative to a landmark of the cheek; 300 in retargeting, where gaps may deviate a little
CHANGE_COST = 0.5  # of changes of the weights in contacts, relative to the median curvature
# Of changes of a smile by gestures: lips close by pressing and rolling; a smaller smile is seen as another mood.
# without a cost the cheapest way to close smiling lips is to smile less (decision 118)
SMILE_COST, SMILE_PREFIX = 5.0, "mouthSmile"
GESTURE_COST = 1.0  # of changes of all weights by gestures
# Of sideways shapes where nothing rolls the lips: left and right together lift a jaw a little, and were used for it.
SIDEWAYS, SIDEWAYS_COST = ("jawLeft", "jawRight", "mouthLeft", "mouthRight"), 20.0
ROLLED = "mouthRollLower"
CORNER_SHAPE = "mouthCorners"  # of moods, which bends both lips alike; does not shut them either
CORNER_CARRIERS = ("mouth",)  # name prefixes of what serves it in files without it; with the jaw it opened by .007
OVERLAP = 3.0  # tolerance of lips pressed into each other, relative to that of a slit between them, which is seen
USUAL_EXPRESSION = 0.3  # weight of a basis expression in speech, at which closed lips shall be so within the tolerance
CLOSED_SMILE_COST = 0.3  # of the smile of a basis expression, whose lips are closed
FULL_GROWTH_GAP_MM = 1.5  # gaps smaller than this are amplified by less than the gain
GAP_TOLERANCE_MM = 0.01  # largest gap of closed lips
FULL_ROUNDING_MM = 8.0  # a mouth this much narrower than at rest is fully rounded
ROUNDING_ATTENUATION = 0.25  # reduction of an expression on a fully rounded mouth, which is still seen to smile


@dataclass(frozen=True, slots=True, eq=False)
class LipConstraints:
    """Lip gaps and mouth width as linear functions of a face's shape weights, and the cost of changing the mouth.

    Parameters
    ----------
    moving : (k,)
        Indices of the shapes that speech moves.
    curvature : (k, k)
        Normal matrix of the visible changes of the mouth without its gaps.
    gaps : (P, K)
        Widening of the gap between facing inner lip points per weight, mm.
    width : (K,)
        Widening of the mouth per weight, mm.
    limits : (k, 2)
        Least and greatest weight of the `moving` shapes.
    is_smile, is_sideways : (k,)
        Whether each of the `moving` shapes smiles, and whether it bends a mouth, or moves one sideways whose lips
        nothing rolls.
    tolerance
        By which gestures may part lips that touch, mm; they may press them together by `OVERLAP` times as much.
    """

    moving: NDArray[np.int64]
    curvature: FloatArray
    gaps: FloatArray
    width: FloatArray
    limits: FloatArray
    is_smile: NDArray[np.bool_]
    is_sideways: NDArray[np.bool_]
    tolerance: float = 0.0

    def with_change_cost(self) -> "LipConstraints":
        """The constraints with a cost of changes of the weights, so that opposite shapes do not act together."""
        return self._with_costs(np.full(len(self.moving), CHANGE_COST))

    def with_gesture_cost(self) -> "LipConstraints":
        """The constraints with a cost of changes of the weights, the largest of a smile's."""
        return self._with_costs(np.where(self.is_smile, GESTURE_COST + SMILE_COST, GESTURE_COST))

    def with_smile_cost(self) -> "LipConstraints":
        """The constraints with a cost of changes of a smile, for basis expressions at weight 1."""
        costly = self._with_costs(np.where(self.is_smile, CLOSED_SMILE_COST, 0.0))
        return replace(costly, tolerance=self.tolerance / USUAL_EXPRESSION)

    def _with_costs(self, costs: FloatArray) -> "LipConstraints":
        """The constraints with costs (k,) of changes of the weights, relative to the median curvature."""
        costs = costs + SIDEWAYS_COST * self.is_sideways
        return replace(self, curvature=self.curvature + np.diag(costs * np.median(np.diag(self.curvature))))

    def combine(self, speech: FloatArray, added: FloatArray) -> FloatArray:
        """Weights (T, K) of speech weights `speech` (T, K) with gesture weights `added` (T, K), lips constrained.

        Where the lips touch, the gap is that of speech; the wider the gap, the more it follows the gesture, and half
        of it always remains. Frames without a gesture are unchanged.
        """
        gaps, widened = ordered_product(speech, self.gaps.T), ordered_product(added, self.gaps.T)
        follow = smoothstep(gaps / FULL_EXPRESSION_GAP_MM)
        target_gaps, least = gaps + follow * widened, np.where(gaps > 0, MIN_GAP_SHARE * gaps, gaps)
        # on faces whose shapes were not modelled to keep lips shut, ten shapes would act against each other for .1 mm
        if self.tolerance:
            target_gaps += (1.0 - follow) * np.clip(widened, -OVERLAP * self.tolerance, self.tolerance)
            least -= OVERLAP * self.tolerance
        return self.solve(speech, added, np.maximum(target_gaps, least))

    def solve(
        self, speech: FloatArray, added: FloatArray, target_gaps: FloatArray, changed: NDArray[np.bool_] | None = None
    ) -> FloatArray:
        """Weights (T, K) nearest to the sum whose gaps beyond rest are `target_gaps` (T, P), mm.

        Frames that are not `changed` (T,), by default those without added weights, are those of the sum.
        """
        total = speech + added
        moving = np.isin(np.arange(total.shape[1]), self.moving)
        remaining = target_gaps - ordered_product(np.where(moving, 0.0, total), self.gaps.T)
        opened = self.gaps[:, self.moving]
        linear = ordered_product(total[:, self.moving], self.curvature) + GAP_CONSTRAINT_WEIGHT * ordered_product(
            remaining, opened
        )
        curvature = self.curvature + GAP_CONSTRAINT_WEIGHT * ordered_product(opened.T, opened)
        rows = np.flatnonzero(added.any(axis=1) if changed is None else changed)
        total[np.ix_(rows, np.flatnonzero(moving))] = bounded_least_squares(curvature, linear[rows], self.limits)
        return np.asarray(total, np.float64)

    def amplify(self, speech: FloatArray, jaw: FloatArray, lips: FloatArray) -> FloatArray:
        """Speech weights (T, K) with jaw and lip motion multiplied by factors (K,), 1 for other shapes.

        All gaps grow by the same share, so that closed lips stay closed. Where the lips counteract the jaw, its gain
        is limited by the gap, because otherwise the upper lip would have to follow it.
        """
        gap = np.maximum(ordered_product(speech, self.gaps[MIDDLE_PAIR]), 0.0)
        by_jaw = np.maximum(
            ordered_product(np.where(jaw == 1.0, 0.0, speech), self.gaps[MIDDLE_PAIR]), GAP_TOLERANCE_MM
        )
        added = speech * (jaw - 1.0) * np.minimum(gap / by_jaw, 1.0)[:, None] + speech * (lips - 1.0)
        largest_gain = max(float(jaw.max()), float(lips.max()))
        grown = np.clip(
            ordered_product(added, self.gaps[MIDDLE_PAIR]) / np.maximum(gap, GAP_TOLERANCE_MM), -1.0, largest_gain - 1.0
        )
        gaps = ordered_product(speech, self.gaps.T)
        return self.solve(
            speech, added, gaps + grown[:, None] * smoothstep(gaps / FULL_GROWTH_GAP_MM) * np.maximum(gaps, 0.0)
        )

    def rounding(self, speech: FloatArray) -> FloatArray:
        """Rounding (T,) of the mouth: 0 as wide as at rest, 1 when narrower by `FULL_ROUNDING_MM`."""
        return smoothstep(-ordered_product(speech, self.width) / FULL_ROUNDING_MM)

    def attenuate_on_rounded_lips(self, speech: FloatArray, added: FloatArray) -> FloatArray:
        """Gesture weights (T, K), reduced on rounded lips."""
        factor = 1.0 - ROUNDING_ATTENUATION * self.rounding(speech)
        softened = added.copy()
        softened[:, self.moving] *= factor[:, None]
        return softened

    def attenuate_on_moved_lips(self, speech: FloatArray, added: FloatArray) -> FloatArray:
        """Gesture weights (T, K), of which each shape has less where speech moves it already: none at its limit."""
        lips, high = self.moving, self.limits[:, 1]
        used = np.divide(speech[:, lips], high, out=np.zeros((len(speech), len(lips))), where=high > 0)
        softened = added.copy()
        softened[:, lips] *= np.where(added[:, lips] > 0, 1.0 - np.clip(used, 0.0, 1.0), 1.0)
        return softened


def build_lip_constraints(face: Face) -> LipConstraints:
    """Lip constraints of a face.

    Raises
    ------
    DataError
        The face lacks landmarks of the lips, or has no shape that speech moves.
    """
    moving = np.array(
        [i for i, name in enumerate(face.shape_names) if name.startswith(SPEECH_SHAPE_PREFIXES)], np.int64
    )
    require_lips(face, moving)
    motion = scatter_landmarks(face, landmark_motion(face, np.arange(len(face.shape_names))))
    common = [landmark for landmark in MOUTH_REGION if np.isfinite(motion[landmark]).all()]
    return LipConstraints(
        moving=moving,
        curvature=mouth_curvature(motion[common][:, :, moving], common),
        gaps=motion[list(INNER_LIP_UPPER), 1] - motion[list(INNER_LIP_LOWER), 1],
        width=motion[MOUTH_CORNER_LEFT, 0] - motion[MOUTH_CORNER_RIGHT, 0],
        limits=face.limits[moving].astype(np.float64),
        is_smile=np.array([face.shape_names[i].startswith(SMILE_PREFIX) for i in moving]),
        is_sideways=np.array(
            [
                name == CORNER_SHAPE or (name in SIDEWAYS and ROLLED not in face.shape_names)
                for name in np.array(face.shape_names)[moving]
            ]
        ),
        tolerance=face.lip_tolerance_mm,
    )
