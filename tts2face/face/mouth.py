"""Mouth of a face: the shapes that speech moves, and the normal matrix of its visible changes."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from tts2face.face.landmarks import landmark_motion, scatter_landmarks
from tts2face.models.face import Face
from tts2face.models.landmarks import (
    INNER_LIP_LOWER,
    INNER_LIP_UPPER,
    LIP_LANDMARKS,
    MOUTH_REGION,
    OUTER_LIP_LOWER,
    OUTER_LIP_UPPER,
)
from tts2face.numeric.arrays import FloatArray, ordered_product

CORNERS_LEFT, CORNERS_RIGHT = (OUTER_LIP_UPPER[-1], INNER_LIP_UPPER[-1]), (OUTER_LIP_UPPER[0], INNER_LIP_UPPER[0])
CHIN_LANDMARKS = (175, 199, 171, 396, 208, 428)  # skin over the bone of the jaw
LIP_WEIGHT = 10.0  # of a lip landmark, relative to one of the jaw or cheek
DEPTH_WEIGHT = 0.1  # of z, relative to x and y: a single camera measures depth with about ten times their error
WIDTH_WEIGHT = 60.0  # of the mouth's width, relative to a landmark: viewers read rounding from it
CHIN_WEIGHT = 600.0  # of the drop of the chin, relative to a landmark: it sets the distance of the teeth
# Not what visemes do: they would make up for differences between the shapes of two faces.
NO_VISEME = ("jawForward", "jawLeft", "jawRight", "mouthLeft", "mouthRight")
LIP_GAP_WEIGHT = 3.0  # of a lip gap, relative to a landmark of the cheek; 300 fits gaps beside the middle by any shape
REGULARISATION = 0.005  # ridge term as a share of the mean curvature: makes the solution unique and smooth


@dataclass(frozen=True, slots=True)
class MouthWeights:
    """Weights of a mouth's width and of the drop of its chin, relative to a landmark of the cheek."""

    width: float = WIDTH_WEIGHT
    chin: float = CHIN_WEIGHT


VISIBLE = MouthWeights()


def mouth_curvature(moved: FloatArray, common: list[int], weights: MouthWeights = VISIBLE) -> FloatArray:
    """Normal matrix (k, k) of the visible changes of a mouth without its lip gaps, plus a ridge term.

    Parameters
    ----------
    moved : (L, 3, k)
        Motion of the landmarks `common` per weight, mm.
    common
        Landmark index of each row of `moved`.
    """
    at = {landmark: row for row, landmark in enumerate(common)}
    curvature: FloatArray = np.einsum("ldk,ldj->kj", moved * landmark_weights(common)[..., None], moved)
    ridge = REGULARISATION * np.trace(curvature) / moved.shape[-1]
    left, right = ([at[corner] for corner in corners] for corners in (CORNERS_LEFT, CORNERS_RIGHT))
    widened = moved[left, 0] - moved[right, 0]
    curvature += weights.width * ordered_product(widened.T, widened) + ridge * np.eye(moved.shape[-1])
    dropped = moved[[at[landmark] for landmark in CHIN_LANDMARKS if landmark in at], 1].mean(axis=0)
    curvature += weights.chin * np.outer(dropped, dropped)
    return curvature


def mouth_products(face: Face, shapes: NDArray[np.int64]) -> FloatArray:
    """Inner products (n, n) of the visible motion of the mouth by some shapes (n,) of a face."""
    return motion_products(scatter_landmarks(face, landmark_motion(face, shapes)))


def motion_products(motion: FloatArray) -> FloatArray:
    """Inner products (n, n) of the visible motion of a mouth, of motions (478, 3, n) of all landmarks."""
    common = [landmark for landmark in MOUTH_REGION if np.isfinite(motion[landmark]).all()]
    opened = motion[list(INNER_LIP_UPPER), 1] - motion[list(INNER_LIP_LOWER), 1]
    return mouth_curvature(motion[common], common) + LIP_GAP_WEIGHT * ordered_product(opened.T, opened)


def require_lips(face: Face, moving: NDArray[np.int64]) -> None:
    """Check that a face has landmarks of the lips and shapes that move them.

    Raises
    ------
    DataError
        A landmark of the lips is missing, or `moving` is empty.
    """
    known = set(face.landmarks.tolist())
    lips = (*INNER_LIP_UPPER, *INNER_LIP_LOWER, *OUTER_LIP_UPPER, *OUTER_LIP_LOWER)
    missing = [landmark for landmark in lips if landmark not in known]
    if missing or not len(moving):
        what = f"landmark {missing[0]} of the lips" if missing else "shapes named jaw... or mouth..."
        raise DataError(f"the face lacks {what}, so speech cannot move it; build it with its landmark table")


def landmark_weights(common: list[int]) -> FloatArray:
    """Weights (L, 3) of the coordinates of the landmarks `common`."""
    per_landmark = np.array([LIP_WEIGHT if landmark in LIP_LANDMARKS else 1.0 for landmark in common])
    weights: FloatArray = per_landmark[:, None] * np.array([1.0, 1.0, DEPTH_WEIGHT])
    return weights
