"""Facial capture files: Live Link Face tables, and markers as C3D, .trc or tables."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from corpus_tools.decomposition.capture import FaceRecording, read_capture_sound
from corpus_tools.decomposition.marker_sets import DEFAULT_MARKER_TABLE, read_marker_set
from corpus_tools.decomposition.markers import read_marker_recording
from lexicon.errors import InputError
from lexicon.values.fields import check_fields
from tts2face.face.landmarks import moved_landmarks, rest_landmarks
from tts2face.lips.performer import match_shapes
from tts2face.models.face import Face
from tts2face.numeric.arrays import Mask
from tts2face.types import Trajectory
from tts2face.video.livelink import FaceCapture, is_capture_table, read_livelink

CAPTURE_SUFFIXES = frozenset({".c3d", ".csv", ".trc", ".tsv"})
LIVELINK_SUFFIXES = frozenset({".csv", ".tsv"})  # in a folder of recordings a .txt is a transcript
# A feature is missing if no channel with one of these prefixes moves.
FEATURE_CHANNELS = {"gaze": ("eyeLook",), "blink": ("eyeBlink",), "brows": ("brow",), "cheeks": ("cheek", "nose")}


@dataclass(frozen=True, slots=True)
class MarkerOptions:
    """Options of marker files: the table of the marker set, a recording of the person at rest, frame rate of tables."""

    marker_table: Path = DEFAULT_MARKER_TABLE
    neutral: Path | None = None
    fps: float | None = None

    def __post_init__(self) -> None:
        """Refuse values of other types (`InputError`)."""
        check_fields(self)


def is_livelink(path: Path) -> bool:
    """Whether a file is a table of ARKit weights, as Live Link Face writes it; marker tables are .csv, too."""
    return path.suffix.lower() in LIVELINK_SUFFIXES and is_capture_table(path)


def read_capture_file(path: Path, face: Face, *, options: MarkerOptions | None = None) -> FaceRecording:
    """A facial capture as landmarks; its sound is that of the file, or of a file of the same name."""
    if path.suffix.lower() not in CAPTURE_SUFFIXES:
        raise InputError(
            f"{path.name} is not a facial capture; supported suffixes are {', '.join(sorted(CAPTURE_SUFFIXES))}"
        )
    options = options or MarkerOptions()
    if is_livelink(path):
        return read_livelink_recording(path, face, options.fps)
    return read_marker_recording(
        path, face, read_marker_set(options.marker_table), neutral=options.neutral, fps=options.fps
    )


def read_livelink_recording(path: Path, face: Face, fps: float | None = None) -> FaceRecording:
    """A Live Link capture in the size of `face`; sound as in `read_capture_sound`, `fps` as in `read_livelink`."""
    capture = read_livelink(path, fps)
    motion = match_shapes(capture.weights, face)
    return FaceRecording(
        name=path.stem,
        fps=capture.weights.fps,
        landmarks=moved_landmarks(face, motion),
        head=np.asarray(capture.head.values, np.float32),
        sound=read_capture_sound(path),
        rest=rest_landmarks(face).astype(np.float32),
        eyes=eye_motion(face, motion),
        missing_features=_missing_features(capture),
        notes=capture.notes,
        left_out=_frames_in_gaps(capture),
    )


def _frames_in_gaps(capture: FaceCapture) -> Mask:
    """Frames (T,) of a capture without a face."""
    times = capture.weights.times
    half_frame = 0.5 / capture.weights.fps
    found: Mask = np.zeros(len(times), np.bool_)
    for start, end in capture.gaps:
        found |= (times > start + half_frame) & (times < end - half_frame)
    return found


def eye_motion(face: Face, motion: Trajectory) -> NDArray[np.float32]:
    """(T, 4) closures of both lids, and pitch and yaw of the eyes, from weights (T, K) of a face's shapes.

    Lids are closed at weight 1, independent of the geometry of the face.
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
    missing = {
        feature for feature, starts in FEATURE_CHANNELS.items() if not any(name.startswith(starts) for name in moving)
    }
    if not capture.head.values.any():
        missing.add("head")
    return frozenset(missing)
