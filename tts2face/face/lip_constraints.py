"""Lips stay in charge: whatever is laid over speech, closed lips stay closed and no lips cross.

Ju and Lee 2008, section 7, warn that an expression with an open mouth opens plosives. Here the gaps between the lips
are wanted values of the solve that puts an expression on speech.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tts2face.face.bounded_least_squares import bounded_least_squares
from tts2face.face.landmark_fit import landmark_motion, scatter_landmarks
from tts2face.face.mouth_model import MIDDLE_PAIR, SPEECH_SHAPE_PREFIXES, mouth_curvature, require_lips
from tts2face.models.face import Face
from tts2face.models.landmarks import (
    INNER_LIP_LOWER,
    INNER_LIP_UPPER,
    MOUTH_CORNER_LEFT,
    MOUTH_CORNER_RIGHT,
    MOUTH_REGION,
)
from tts2face.numeric import ordered_product

FULL_EXPRESSION_GAP_MM = (
    4.0  # lips so far apart follow an expression in full; nearer ones less, touching ones not at all
)
MIN_GAP_SHARE = 0.5  # of the gap of speech that an expression leaves open
GAP_CONSTRAINT_WEIGHT = (
    1e5  # weight of a gap against a landmark of the cheek: 300 in speech, where gaps may give way a little
)
FULL_GROWTH_GAP_MM = 1.5  # lips nearer than this grow apart by less than their share
GAP_TOLERANCE_MM = 0.01  # a gap that is none
FULL_ROUNDING_MM = 8.0  # a mouth narrower by this than at rest is rounded in full ...
ROUNDING_ATTENUATION = 0.6  # ... and takes this share less of what an expression does to it, so that /u w/ stay round

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class LipConstraints:
    """What lips do for weights of a face's shapes.

    Parameters
    ----------
    moving : (k,)
        Numbers of the shapes that speech moves.
    curvature : (k, k)
        Of all that is seen of a mouth but its gaps.
    gaps : (P, K)
        Widening of the gap between facing inner lip points per weight, mm.
    width : (K,)
        Of the mouth, likewise.
    limits : (k, 2)
    """

    moving: NDArray[np.int64]
    curvature: FloatArray
    gaps: FloatArray
    width: FloatArray
    limits: FloatArray

    def held(self, spoken: FloatArray, added: FloatArray) -> FloatArray:
        """(T, K) weights for those of speech and what is laid over them, (T, K) each.

        A gap is that of speech where the lips touch, and follows what is added the more the further they are apart;
        half of it stays. Frames to which nothing is added are as they were.
        """
        gaps, widened = ordered_product(spoken, self.gaps.T), ordered_product(added, self.gaps.T)
        wanted = gaps + _smoothstep(gaps / FULL_EXPRESSION_GAP_MM) * widened
        return self._solve(spoken, added, np.maximum(wanted, np.where(gaps > 0, MIN_GAP_SHARE * gaps, gaps)))

    def _solve(self, spoken: FloatArray, added: FloatArray, wanted: FloatArray) -> FloatArray:
        """(T, K) weights nearest to the sum with gaps (T, P) as wanted, beyond those at rest."""
        total = spoken + added
        moving = np.isin(np.arange(total.shape[1]), self.moving)
        left = wanted - ordered_product(np.where(moving, 0.0, total), self.gaps.T)
        opened = self.gaps[:, self.moving]
        linear = ordered_product(total[:, self.moving], self.curvature) + GAP_CONSTRAINT_WEIGHT * ordered_product(
            left, opened
        )
        curvature = self.curvature + GAP_CONSTRAINT_WEIGHT * ordered_product(opened.T, opened)
        changed = added.any(axis=1)
        total[np.ix_(changed, moving)] = bounded_least_squares(curvature, linear[changed], self.limits)
        return np.asarray(total, np.float64)

    def amplify(self, spoken: FloatArray, jaw: FloatArray, lips: FloatArray) -> FloatArray:
        """(T, K) weights of speech with the motion of jaw and lips multiplied by factors (K,), 1 for other shapes.

        All gaps grow by one share, so that those that are closed stay closed. Behind lips that hold together what the
        jaw opens, it drops no further than they part, or the upper lip must come after it.
        """
        gap = np.maximum(ordered_product(spoken, self.gaps[MIDDLE_PAIR]), 0.0)
        by_jaw = np.maximum(
            ordered_product(np.where(jaw == 1.0, 0.0, spoken), self.gaps[MIDDLE_PAIR]), GAP_TOLERANCE_MM
        )
        added = spoken * (jaw - 1.0) * np.minimum(gap / by_jaw, 1.0)[:, None] + spoken * (lips - 1.0)
        most = max(float(jaw.max()), float(lips.max()))
        grown = np.clip(
            ordered_product(added, self.gaps[MIDDLE_PAIR]) / np.maximum(gap, GAP_TOLERANCE_MM), -1.0, most - 1.0
        )
        gaps = ordered_product(spoken, self.gaps.T)
        return self._solve(
            spoken, added, gaps + grown[:, None] * _smoothstep(gaps / FULL_GROWTH_GAP_MM) * np.maximum(gaps, 0.0)
        )

    def rounded(self, spoken: FloatArray) -> FloatArray:
        """(T,) how far the mouth is rounded: 0 as wide as at rest, 1 by `FULL_ROUNDING_MM` narrower."""
        return _smoothstep(-ordered_product(spoken, self.width) / FULL_ROUNDING_MM)

    def attenuate_on_rounded_lips(self, spoken: FloatArray, added: FloatArray) -> FloatArray:
        """(T, K) what is laid over speech, less of it on rounded lips."""
        kept = 1.0 - ROUNDING_ATTENUATION * self.rounded(spoken)
        softened = added.copy()
        softened[:, self.moving] *= kept[:, None]
        return softened


def build_lip_constraints(face: Face) -> LipConstraints:
    """The mouth of a face.

    Raises
    ------
    DataError
        The face lacks the lips' landmarks, or has no shape that speech could move.
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
    )


def _smoothstep(share: FloatArray) -> FloatArray:
    held = np.clip(share, 0.0, 1.0)
    eased: FloatArray = held * held * (3.0 - 2.0 * held)
    return eased
