"""Eyelid model of a face: blinks as shares of the eye opening.

Ju and Lee 2008, section 5.2: an affine transform between the lids of two faces, so that they match at wide opening and
at closing. Blinks are transferred as shares of the opening, so that lids meet and never cross under any other shape.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from tts2face.face.landmarks import landmark_motion, landmark_positions, scatter_landmarks
from tts2face.models.face import Face
from tts2face.numeric.arrays import FloatArray, ordered_product

SIDES = ("Left", "Right")  # of the face itself, in the order of `tts2face.models.palette.EYE_CHANNELS`
# Upper and lower lid of each eye, at the middle and halfway to the nose: where they meet last.
LID_LANDMARK_PAIRS = (((386, 385), (374, 380)), ((159, 158), (145, 153)))
BLINK_SHAPES, WIDE_SHAPES = ("eyeBlinkLeft", "eyeBlinkRight"), ("eyeWideLeft", "eyeWideRight")
NARROWING_SHAPES = (("eyeSquintLeft", "cheekSquintLeft"), ("eyeSquintRight", "cheekSquintRight"))
STILL_LIDS = 1e9  # mm per weight of a shape that moves nothing, as of eyes that are one with the skin: it stays near 0
MAX_NARROWING = 0.6  # largest share of the opening that squinting may close


@dataclass(frozen=True, slots=True, eq=False)
class EyelidModel:
    """Eye opening as a linear function of a face's shape weights.

    Parameters
    ----------
    opening : (2,)
        Opening of each eye at rest, mm.
    per_weight : (2, K)
        Change of the opening per weight of each shape, mm.
    blink, wide : (2,)
        Indices of the shapes that close and widen each eye.
    narrowing : (2, n)
        Indices of the shapes that narrow each eye.
    limits : (K, 2)
        Least and greatest weight of each shape.
    """

    opening: FloatArray
    per_weight: FloatArray
    blink: NDArray[np.int64]
    wide: NDArray[np.int64]
    narrowing: NDArray[np.int64]
    limits: FloatArray

    def close(self, weights: FloatArray, shares: FloatArray) -> FloatArray:
        """Weights (T, K) with the lids closed by shares (T, 2) of their opening: 0 keeps it, 1 closes the eye.

        Negative shares widen. Shapes that narrow or widen an eye are attenuated by the share.
        """
        lids = weights.copy()
        for eye in range(len(SIDES)):
            self._limit_narrowing(lids, eye)
            lids[:, [self.wide[eye], *self.narrowing[eye]]] *= 1.0 - np.clip(shares[:, eye : eye + 1], 0.0, 1.0)
            # lids that cross are shut
            opening = np.maximum(self.opening[eye] + ordered_product(lids, self.per_weight[eye]), 0.0)
            for column, share in ((self.blink[eye], shares[:, eye]), (self.wide[eye], shares[:, eye])):
                per_weight = self.per_weight[eye, column]
                change = -opening * (np.maximum(share, 0.0) if per_weight < 0 else np.minimum(share, 0.0)) / per_weight
                lids[:, column] = np.clip(lids[:, column] + change, *self.limits[column])
        return lids

    def _limit_narrowing(self, lids: FloatArray, eye: int) -> None:
        """Limit the narrowing shapes to `MAX_NARROWING` of the opening, in place."""
        columns = self.narrowing[eye]
        narrowed = -ordered_product(lids[:, columns], self.per_weight[eye, columns])
        opening = self.opening[eye] + ordered_product(lids, self.per_weight[eye]) + narrowed
        allowed = MAX_NARROWING * np.maximum(opening, 0.0)
        lids[:, columns] *= np.where(narrowed > allowed, allowed / np.maximum(narrowed, 1e-9), 1.0)[:, None]


def build_eyelid_model(face: Face) -> EyelidModel:
    """Eyelid model of a face with the shapes `BLINK_SHAPES`, `WIDE_SHAPES` and `NARROWING_SHAPES`.

    Raises
    ------
    DataError
        The face lacks landmarks of its lids, or its blink and wide shapes do not close and open them.
    """
    places = scatter_landmarks(face, landmark_positions(face))[:, 1]
    motion = scatter_landmarks(face, landmark_motion(face, np.arange(len(face.shape_names))))[:, 1]
    opening = np.array([(places[list(upper)] - places[list(lower)]).mean() for upper, lower in LID_LANDMARK_PAIRS])
    per_weight = np.stack(
        [(motion[list(upper)] - motion[list(lower)]).mean(axis=0) for upper, lower in LID_LANDMARK_PAIRS]
    )
    number = {name: column for column, name in enumerate(face.shape_names)}
    blink, wide = (np.array([number[name] for name in names], np.int64) for names in (BLINK_SHAPES, WIDE_SHAPES))
    for columns, direction in ((blink, -STILL_LIDS), (wide, STILL_LIDS)):
        is_still = ~face.shapes[columns].any(axis=(1, 2))
        per_weight[is_still, columns[is_still]] = direction
    if not (np.isfinite(opening).all() and (opening > 0).all()):
        raise DataError("the face lacks landmarks of its lids; build it with its landmark table")
    if not all((per_weight[eye, blink[eye]] < 0) and (per_weight[eye, wide[eye]] > 0) for eye in range(len(SIDES))):
        raise DataError(
            f"{BLINK_SHAPES[0]} does not close the face's lids, or {WIDE_SHAPES[0]} does not open them; build it again"
        )
    return EyelidModel(
        opening=opening,
        per_weight=per_weight,
        blink=blink,
        wide=wide,
        narrowing=np.array([[number[name] for name in names] for names in NARROWING_SHAPES], np.int64),
        limits=face.limits.astype(np.float64),
    )
