"""Facial captures by their kind: Live Link Face tables, and markers as C3D or tables."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from corpus_tools.decomposition.capture import FaceRecording, read_capture_sound
from corpus_tools.decomposition.face_motion import moved_landmarks, rest_landmarks
from corpus_tools.decomposition.marker_set import DEFAULT_MARKER_TABLE, read_marker_set
from corpus_tools.decomposition.markers import read_marker_recording
from lexicon.errors import InputError
from tts2face.models.face import Face
from tts2face.retargeting.performer import match_shapes
from tts2face.types import Trajectory
from tts2face.video.livelink import FaceCapture, read_livelink

CAPTURE_SUFFIXES = frozenset({".c3d", ".csv"})
LIVELINK_FIRST_COLUMN = "timecode"  # first column of a Live Link Face table


@dataclass(frozen=True, slots=True)
class MarkerOptions:
    """How markers are read: the table of their set, a recording of the person at rest, frames a second of tables."""

    marker_table: Path = DEFAULT_MARKER_TABLE
    neutral: Path | None = None
    fps: float | None = None


def is_livelink(path: Path) -> bool:
    """Whether a file begins as a Live Link Face table does."""
    if path.suffix.lower() != ".csv" or not path.is_file():
        return False
    with path.open("rb") as file:
        return file.read(64).decode("utf-8-sig", errors="replace").lower().startswith(LIVELINK_FIRST_COLUMN)


def read_capture_file(
    path: Path, face: Face, *, sound: Path | None = None, worn: MarkerOptions | None = None
) -> FaceRecording:
    """A capture of whichever kind, as landmarks; sound from the file, as given, or of the same name beside it.

    Raises
    ------
    InputError
        There is no such file, or it is of another kind.
    DataError
        It is damaged; or as `read_marker_recording` says.
    BackendError
        Reading C3D needs a package that is missing.
    """
    if path.suffix.lower() not in CAPTURE_SUFFIXES:
        raise InputError(f"{path.name} is no facial capture; they are read from {', '.join(sorted(CAPTURE_SUFFIXES))}")
    if is_livelink(path):
        return read_livelink_recording(path, face, sound=sound)
    how = worn or MarkerOptions()
    return read_marker_recording(
        path, face, read_marker_set(how.marker_table), neutral=how.neutral, sound=sound, fps=how.fps
    )


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
