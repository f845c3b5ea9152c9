"""A Live Link Face capture as landmarks: its weights on a face that has the shapes of those names."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from corpus_tools.decomposition.capture import FaceRecording, read_capture_sound
from corpus_tools.decomposition.face_motion import moved_landmarks, rest_landmarks
from tts2face.models.face import Face
from tts2face.retargeting.performer import match_shapes
from tts2face.types import Trajectory
from tts2face.video.livelink import FaceCapture, read_livelink

# Channels without which a feature is not told.
FEATURE_CHANNELS = {"gaze": ("eyeLook",), "blink": ("eyeBlink",), "brows": ("brow",), "cheeks": ("cheek", "nose")}


def read_livelink_recording(path: Path, face: Face, *, sound: Path | None = None) -> FaceRecording:
    """A capture, in the size of the face that it moves; sound as `read_capture_sound` finds it.

    Raises
    ------
    InputError
        There is no such file.
    DataError
        It is damaged, or the face lacks landmarks.
    """
    capture = read_livelink(path)
    motion = match_shapes(capture.weights, face)
    return FaceRecording(
        name=path.stem,
        fps=capture.weights.fps,
        landmarks=moved_landmarks(face, motion),
        head=np.asarray(capture.head.values, np.float32),
        sound=read_capture_sound(path, sound),
        rest=rest_landmarks(face).astype(np.float32),
        eyes=eye_motion(face, motion),
        missing_features=_missing_features(capture),
    )


def eye_motion(face: Face, motion: Trajectory) -> NDArray[np.float32]:
    """(T, 4) shares by which both lids are shut, and pitch and yaw of the eyes, of weights (T, K) of a face's shapes.

    The capture's own measure: its lids are shut at 1, wherever those of the face meet.
    """
    at = {name: number for number, name in enumerate(face.shape_names)}
    lids = [motion.values[:, at[f"eyeBlink{side}"]] for side in ("Left", "Right")]
    turned = np.zeros((len(motion), 2))
    for eye in face.eyes:
        for name, turn in eye.turns.items():
            turned += motion.values[:, at[name], None] * turn[:2] / len(face.eyes)
    return np.column_stack([*lids, turned]).astype(np.float32)


def _missing_features(capture: FaceCapture) -> frozenset[str]:
    """Features whose channels are missing or never move."""
    moving = [
        name for name, values in zip(capture.weights.channels, capture.weights.values.T, strict=True) if np.ptp(values)
    ]
    untold = {
        feature for feature, begins in FEATURE_CHANNELS.items() if not any(name.startswith(begins) for name in moving)
    }
    if not capture.head.values.any():
        untold.add("head")
    return frozenset(untold)
