"""A Live Link Face capture as landmarks: its weights on a face that has the shapes of those names."""

from pathlib import Path

import numpy as np

from corpus_tools.decompose.captured import Captured, sound_of
from corpus_tools.decompose.face_motion import moved_landmarks, rest_landmarks
from tts2face.face.model import Face
from tts2face.mimic import motion_of_capture
from tts2face.video.livelink import Capture, read_livelink

# Channels without which a feature is not told.
NEEDED = {"gaze": ("eyeLook",), "blink": ("eyeBlink",), "brows": ("brow",), "cheeks": ("cheek", "nose")}


def captured_livelink(path: Path, face: Face, *, sound: Path | None = None) -> Captured:
    """A capture, in the size of the face that it moves; sound as `sound_of` finds it.

    Raises
    ------
    InputError
        There is no such file.
    DataError
        It is damaged, or the face lacks landmarks.
    """
    capture = read_livelink(path)
    motion = motion_of_capture(capture, face)
    return Captured(
        name=path.stem,
        fps=capture.weights.fps,
        landmarks=moved_landmarks(face, motion.face),
        head=np.asarray(capture.head.values, np.float32),
        sound=sound_of(path, sound),
        rest=rest_landmarks(face).astype(np.float32),
        missing=_untold(capture),
    )


def _untold(capture: Capture) -> frozenset[str]:
    """Features whose channels are missing or never move."""
    moving = [
        name for name, values in zip(capture.weights.channels, capture.weights.values.T, strict=True) if np.ptp(values)
    ]
    untold = {feature for feature, begins in NEEDED.items() if not any(name.startswith(begins) for name in moving)}
    if not capture.head.values.any():
        untold.add("head")
    return frozenset(untold)
