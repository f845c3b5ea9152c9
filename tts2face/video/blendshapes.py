"""Blendshape scores of tracked landmarks: smile, jaw opening, blink and 49 others."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.models.landmarks import N_LANDMARKS
from tts2face.video.networks import find_bundle, load_network

# Outputs of the network in order. Source: MediaPipe's blendshape model card; ARKit names without tongueOut.
BLENDSHAPES = (
    "neutral", "browDownLeft", "browDownRight", "browInnerUp", "browOuterUpLeft", "browOuterUpRight", "cheekPuff",
    "cheekSquintLeft", "cheekSquintRight", "eyeBlinkLeft", "eyeBlinkRight", "eyeLookDownLeft", "eyeLookDownRight",
    "eyeLookInLeft", "eyeLookInRight", "eyeLookOutLeft", "eyeLookOutRight", "eyeLookUpLeft", "eyeLookUpRight",
    "eyeSquintLeft", "eyeSquintRight", "eyeWideLeft", "eyeWideRight", "jawForward", "jawLeft", "jawOpen", "jawRight",
    "mouthClose", "mouthDimpleLeft", "mouthDimpleRight", "mouthFrownLeft", "mouthFrownRight", "mouthFunnel",
    "mouthLeft", "mouthLowerDownLeft", "mouthLowerDownRight", "mouthPressLeft", "mouthPressRight", "mouthPucker",
    "mouthRight", "mouthRollLower", "mouthRollUpper", "mouthShrugLower", "mouthShrugUpper", "mouthSmileLeft",
    "mouthSmileRight", "mouthStretchLeft", "mouthStretchRight", "mouthUpperUpLeft", "mouthUpperUpRight",
    "noseSneerLeft", "noseSneerRight",
)  # fmt: skip
# Landmarks that the network reads, in order. Source: MediaPipe's blendshape graph.
INPUT_LANDMARKS = (
    0, 1, 4, 5, 6, 7, 8, 10, 13, 14, 17, 21, 33, 37, 39, 40, 46, 52, 53, 54, 55, 58, 61, 63, 65, 66, 67, 70, 78, 80,
    81, 82, 84, 87, 88, 91, 93, 95, 103, 105, 107, 109, 127, 132, 133, 136, 144, 145, 146, 148, 149, 150, 152, 153, 154,
    155, 157, 158, 159, 160, 161, 162, 163, 168, 172, 173, 176, 178, 181, 185, 191, 195, 197, 234, 246, 249, 251, 263,
    267, 269, 270, 276, 282, 283, 284, 285, 288, 291, 293, 295, 296, 297, 300, 308, 310, 311, 312, 314, 317, 318, 321,
    323, 324, 332, 334, 336, 338, 356, 361, 362, 365, 373, 374, 375, 377, 378, 379, 380, 381, 382, 384, 385, 386, 387,
    388, 389, 390, 397, 398, 400, 402, 405, 409, 415, 454, 466, 468, 469, 470, 471, 472, 473, 474, 475, 476, 477,
)  # fmt: skip


class BlendshapeReader:
    """Network that scores the 52 `BLENDSHAPES`.

    Parameters
    ----------
    model
        Path of the model bundle; if None, see `tts2face.video.networks.find_bundle`.

    Raises
    ------
    BackendError
        LiteRT or the bundle is missing.
    """

    def __init__(self, model: Path | None = None) -> None:
        self._network = load_network(find_bundle(model), "face_blendshapes")

    def blendshape_scores(self, landmarks: NDArray[np.floating]) -> NDArray[np.float32]:
        """(52,) scores in [0, 1] of (478, 3) landmarks in pixels, as `FaceTracker` returns them.

        Raises
        ------
        InputError
            The landmarks have another shape or are not finite.
        """
        if landmarks.shape != (N_LANDMARKS, 3) or not np.isfinite(landmarks).all():
            raise InputError(f"blendshapes need finite landmarks of shape ({N_LANDMARKS}, 3), not {landmarks.shape}")
        points = landmarks[list(INPUT_LANDMARKS), :2].astype(np.float32)
        return self._network(points[None])[0].ravel()
