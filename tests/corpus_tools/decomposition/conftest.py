"""The shipped head moved by made weights, and the same motion as markers."""

import numpy as np
import pytest

from corpus_tools.decomposition.marker_sets import MarkerSet, read_marker_set
from tests.corpus_tools.decomposition.made_markers import FPS, Made, made_take
from tts2face.face.landmarks import moved_landmarks
from tts2face.models.face import Face
from tts2face.models.face_loading import load_face
from tts2face.types import Trajectory

N_FRAMES = 480  # 4 s at 120 frames a second
MOVING = {"jawOpen": 0.25, "browInnerUp": 0.5, "browDownLeft": 0.3, "eyeBlinkLeft": 0.5, "eyeBlinkRight": 0.5,
          "mouthSmileLeft": 0.4, "mouthSmileRight": 0.3, "mouthPucker": 0.2, "cheekSquintLeft": 0.4,
          "eyeLookUpLeft": 0.3}  # fmt: skip


@pytest.fixture(scope="session")
def face() -> Face:
    return load_face("head")


@pytest.fixture(scope="session")
def marker_set() -> MarkerSet:
    return read_marker_set()


@pytest.fixture(scope="session")
def made(face: Face, marker_set: MarkerSet) -> Made:
    """A made performance with a moving head; the face is at rest in the first half second."""
    t = np.arange(N_FRAMES) / FPS
    weights = np.zeros((N_FRAMES, len(face.shape_names)))
    for number, (name, most) in enumerate(MOVING.items()):
        weights[:, face.shape_names.index(name)] = most * np.sin(np.pi * (0.7 + 0.17 * number) * t) ** 2
    weights[t < 0.5] = 0.0
    head = np.stack([0.2 * np.sin(t), 0.3 * np.sin(1.3 * t), 0.1 * np.cos(t), *(15 * np.sin(k * t) for k in (1, 2, 3))])
    return made_take(moved_landmarks(face, Trajectory(face.shape_names, weights, FPS)), head.T, face, marker_set)
