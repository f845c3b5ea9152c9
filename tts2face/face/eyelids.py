"""Lids that shut on every face: fitted to where they are fully open and fully closed.

Ju and Lee 2008, section 5.2: an affine transform between the lids of two faces, so that they match at wide opening and
at closing. Shares of the opening are carried, so that lids meet whatever else moves them, and never cross.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from tts2face.face.landmark_fit import landmark_motion, landmark_positions, scatter_landmarks
from tts2face.models.face import Face
from tts2face.numeric import ordered_product

SIDES = ("Left", "Right")  # the face's own, in the order of `tts2face.models.palette.EYE_CHANNELS`
# Upper and lower lid of each eye, at the middle and halfway to the nose: where they meet last.
LID_LANDMARK_PAIRS = (((386, 385), (374, 380)), ((159, 158), (145, 153)))
BLINK_SHAPES, WIDE_SHAPES = ("eyeBlinkLeft", "eyeBlinkRight"), ("eyeWideLeft", "eyeWideRight")
NARROWING_SHAPES = (("eyeSquintLeft", "cheekSquintLeft"), ("eyeSquintRight", "cheekSquintRight"))
MAX_NARROWING = 0.6  # of the opening that squinting may take, so that lids that nobody shuts do not meet

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class EyelidModel:
    """What lids do for weights of a face's shapes.

    Parameters
    ----------
    opening : (2,)
        Of each eye at rest, mm.
    per_weight : (2, K)
        Widening per weight of each shape, mm.
    blink, wide : (2,)
        Numbers of the shapes that shut and widen each eye.
    narrowing : (2, n)
        Those that narrow it.
    limits : (K, 2)
    """

    opening: FloatArray
    per_weight: FloatArray
    blink: NDArray[np.int64]
    wide: NDArray[np.int64]
    narrowing: NDArray[np.int64]
    limits: FloatArray

    def close(self, weights: FloatArray, shares: FloatArray) -> FloatArray:
        """(T, K) weights with the lids shut by (T, 2) shares of their opening: 0 as the weights leave them, 1 shut.

        What squints or widens an eye gives way as it shuts.
        """
        lids = weights.copy()
        for eye in range(len(SIDES)):
            self._limit_narrowing(lids, eye)
            lids[:, [self.wide[eye], *self.narrowing[eye]]] *= 1.0 - np.clip(shares[:, eye : eye + 1], 0.0, 1.0)
            opening = np.maximum(self.opening[eye] + ordered_product(lids, self.per_weight[eye]), 0.0)
            for column, share in ((self.blink[eye], shares[:, eye]), (self.wide[eye], shares[:, eye])):
                per_weight = self.per_weight[eye, column]
                moved = -opening * (np.maximum(share, 0.0) if per_weight < 0 else np.minimum(share, 0.0)) / per_weight
                lids[:, column] = np.clip(lids[:, column] + moved, *self.limits[column])
        return lids

    def _limit_narrowing(self, lids: FloatArray, eye: int) -> None:
        """Hold squinting within what is open, in place."""
        columns = self.narrowing[eye]
        taken = -ordered_product(lids[:, columns], self.per_weight[eye, columns])
        others = self.opening[eye] + ordered_product(lids, self.per_weight[eye]) + taken
        most = MAX_NARROWING * np.maximum(others, 0.0)
        lids[:, columns] *= np.where(taken > most, most / np.maximum(taken, 1e-9), 1.0)[:, None]


def build_eyelid_model(face: Face) -> EyelidModel:
    """The lids of a face that has the shapes `BLINK_SHAPES`, `WIDE_SHAPES` and `NARROWING_SHAPES`.

    Raises
    ------
    DataError
        It lacks their landmarks, or its shapes do not move them.
    """
    places = scatter_landmarks(face, landmark_positions(face))[:, 1]
    motion = scatter_landmarks(face, landmark_motion(face, np.arange(len(face.shape_names))))[:, 1]
    opening = np.array([(places[list(upper)] - places[list(lower)]).mean() for upper, lower in LID_LANDMARK_PAIRS])
    per_weight = np.stack(
        [(motion[list(upper)] - motion[list(lower)]).mean(axis=0) for upper, lower in LID_LANDMARK_PAIRS]
    )
    number = {name: column for column, name in enumerate(face.shape_names)}
    blink, wide = (np.array([number[name] for name in names], np.int64) for names in (BLINK_SHAPES, WIDE_SHAPES))
    if not (np.isfinite(opening).all() and (opening > 0).all()):
        raise DataError("the face lacks landmarks of its lids; build it with its landmark table")
    if not all((per_weight[eye, blink[eye]] < 0) and (per_weight[eye, wide[eye]] > 0) for eye in range(len(SIDES))):
        raise DataError(
            f"{BLINK_SHAPES[0]} does not shut the face's lids, or {WIDE_SHAPES[0]} does not open them; build it again"
        )
    return EyelidModel(
        opening=opening,
        per_weight=per_weight,
        blink=blink,
        wide=wide,
        narrowing=np.array([[number[name] for name in names] for names in NARROWING_SHAPES], np.int64),
        limits=face.limits.astype(np.float64),
    )
