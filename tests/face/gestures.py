"""A small palette on the starter talker's landmarks, and landmarks of a posed face."""

import numpy as np

from tts2face.face.landmarks import landmark_motion, landmark_positions
from tts2face.models.face import Face
from tts2face.models.palette import FaceRegion, Palette, Style
from tts2face.models.talker_file import load_talker

BROWS = (70, 63, 105, 66, 107, 55, 65, 52, 53, 46, 336, 296, 334, 293, 300, 276, 283, 282, 295, 285)
CHEEKS = (205, 425, 50, 280, 117, 346, 129, 358, 98, 327, 36, 266, 101, 330)


def neutral() -> np.ndarray:
    """Landmarks of the starter talker at rest, mm."""
    model = load_talker("grid_s1").model
    return model.mean + np.einsum("m,mld->ld", model.rest, model.basis)


def region(landmarks: tuple[int, ...]) -> FaceRegion:
    """Two modes: all landmarks up, and the left ones up with the right ones down."""
    sides = np.sign(neutral()[list(landmarks), 0])
    up, apart = np.zeros((2, len(landmarks), 3))
    up[:, 1], apart[:, 1] = 1 / np.sqrt(len(landmarks)), sides / np.sqrt(len(landmarks))
    apart -= (apart * up).sum() * up
    return FaceRegion(np.array(landmarks, np.int32), np.stack([up, apart / np.linalg.norm(apart)]).astype(np.float32))


def palette() -> Palette:
    """Regions of brows and cheeks, and a style of one frame."""
    one = np.zeros(1, np.float32)
    style = Style(np.ones(1, np.int32), one, one, {"blink": np.zeros((1, 2), np.float32)})
    return Palette(neutral(), {"brows": region(BROWS), "cheeks": region(CHEEKS)}, {"still": style}, {})


def posed_landmarks(face: Face, weights: np.ndarray) -> np.ndarray:
    """(T, L, 3) landmarks for weights (T, K); eyeballs do not turn."""
    motion = landmark_motion(face, np.arange(len(face.shape_names)))
    return landmark_positions(face) + np.einsum("lck,tk->tlc", motion, weights)
