"""Recorded face motion from any source as input of the decomposition: pose-free landmarks, head pose and sound."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from corpus_tools.recordings.sound import SOUND_RATE
from lexicon.errors import DataError, InputError
from tts2face.models.landmarks import N_LANDMARKS
from tts2face.models.palette import FEATURES, GESTURE_FPS
from tts2face.numeric.arrays import FloatArray, Mask
from tts2face.types import HEAD_CHANNELS, Waveform
from tts2face.video.media import read_sound

SOUND_SUFFIXES = (".wav", ".flac", ".m4a", ".mp3", ".ogg", ".opus", ".mov", ".mp4")  # of sound files beside a capture
CHUNK_SIZE = 128  # coordinates resampled at once, to bound memory
RATE_TOLERANCE_FPS = 1e-6  # frames a second


@dataclass(frozen=True, slots=True, eq=False)
class FaceRecording:
    """One recording; frame i is the instant ``i / fps`` of its sound.

    Parameters
    ----------
    landmarks : (T, 478, 3)
        Millimetres of the person's own size, head pose removed; axes as in `tts2face.models.landmarks`.
    head : (T, 6)
        `HEAD_CHANNELS`.
    rest : (478, 3)
        The face at rest, mm, if the source provides it.
    eyes : (T, 4)
        Closure of the left and the right lids in 0..1, pitch and yaw of the eyes in the head in radians, if the source
        provides them; otherwise they are computed from landmarks.
    missing
        Features of `tts2face.models.palette.FEATURES` that the source does not contain.
    left_out : (T,)
        Frames in which the face is hidden for too long to be interpolated: no style is learnt from them. None: none.
    notes
        Interpolations and assumptions, one sentence each.
    """

    name: str
    fps: float
    landmarks: NDArray[np.float32]
    head: NDArray[np.float32]
    sound: Waveform | None = None
    rest: NDArray[np.float32] | None = None
    eyes: NDArray[np.float32] | None = None
    missing_features: frozenset[str] = frozenset()
    notes: tuple[str, ...] = ()
    left_out: Mask | None = None

    def __post_init__(self) -> None:
        """Check the shapes of landmarks and head poses, and the names of features."""
        n_frames = len(self.landmarks)
        if self.landmarks.shape != (n_frames, N_LANDMARKS, 3) or self.head.shape != (n_frames, len(HEAD_CHANNELS)):
            raise DataError(
                f"{self.name} has landmarks {self.landmarks.shape} and head poses {self.head.shape}; record it again"
            )
        if not n_frames or not np.isfinite(self.landmarks).all() or not np.isfinite(self.head).all():
            raise DataError(f"{self.name} has no frame, or frames without a face; record it again")
        if self.left_out is not None and len(self.left_out) != n_frames:
            raise DataError(f"{self.name} has {n_frames} frames, not {len(self.left_out)}; record it again")
        unknown = self.missing_features - set(FEATURES)
        if unknown:
            raise InputError(f"there is no feature {sorted(unknown)[0]!r}; gestures consist of {', '.join(FEATURES)}")


def resample_to_gesture_rate(captured: FaceRecording) -> FaceRecording:
    """The recording at `GESTURE_FPS` frames a second."""
    if abs(captured.fps - GESTURE_FPS) < RATE_TOLERANCE_FPS:
        return captured
    landmarks = resample(captured.landmarks, captured.fps, GESTURE_FPS).astype(np.float32)
    is_out = captured.left_out
    return replace(
        captured,
        fps=GESTURE_FPS,
        landmarks=landmarks,
        head=resample(captured.head, captured.fps, GESTURE_FPS).astype(np.float32),
        eyes=None if captured.eyes is None else resample(captured.eyes, captured.fps, GESTURE_FPS).astype(np.float32),
        left_out=None if is_out is None else _resample_mask(is_out, captured.fps, len(landmarks)),
    )


def _resample_mask(frames: Mask, fps: float, n_frames: int) -> Mask:
    """Frames (N,) at `GESTURE_FPS`, True where one of both of `frames` (T,) beside them is."""
    at = np.arange(n_frames) / GESTURE_FPS * fps
    low, high = np.floor(at + RATE_TOLERANCE_FPS), np.ceil(at - RATE_TOLERANCE_FPS)
    last = len(frames) - 1
    return np.asarray(frames[np.minimum(low, last).astype(int)] | frames[np.minimum(high, last).astype(int)])


def resample(values: NDArray[np.floating], fps: float, target_fps: float) -> FloatArray:
    """Values (T, ...) at another frame rate, with the first frame at the same instant.

    Raises
    ------
    InputError
        There is no frame, or a rate is not above 0.

    Notes
    -----
    Values of the cubic spline through the frames; linear interpolation from 25 to 30 frames per second would smooth
    five frames of six. For a lower rate, means of the spline over each frame, to avoid aliasing.
    """
    if not len(values) or not (fps > 0 and target_fps > 0):
        raise InputError(f"{fps:g} frames per second cannot be resampled to {target_fps:g}; give rates above 0")
    flat = np.asarray(values, np.float64).reshape(len(values), -1)
    n_frames = int(np.floor((len(values) - 1) / fps * target_fps + RATE_TOLERANCE_FPS)) + 1
    read = np.zeros((n_frames, flat.shape[1]))
    for first in range(0, flat.shape[1], CHUNK_SIZE):
        columns = slice(first, first + CHUNK_SIZE)
        read[:, columns] = _interpolate_frames(flat[:, columns], fps, target_fps, n_frames)
    return read.reshape(n_frames, *values.shape[1:])


def _interpolate_frames(values: FloatArray, fps: float, target_fps: float, n_frames: int) -> FloatArray:
    from scipy.interpolate import make_interp_spline

    instants, end = np.arange(n_frames) / target_fps, (len(values) - 1) / fps
    if len(values) == 1:
        return values
    # a cubic needs four frames
    curve = make_interp_spline(np.arange(len(values)) / fps, values, k=min(3, len(values) - 1))
    if target_fps >= fps:
        return np.asarray(curve(np.minimum(instants, end)))
    start, stop = np.clip(instants - 0.5 / target_fps, 0, end), np.clip(instants + 0.5 / target_fps, 0, end)
    area = curve.antiderivative()
    return np.asarray((area(stop) - area(start)) / (stop - start)[:, None])


def read_capture_sound(capture: Path) -> Waveform | None:
    """The sound of the file that `find_capture_sound` finds for a capture."""
    found = find_capture_sound(capture)
    return None if found is None else read_sound(found, SOUND_RATE)


def find_capture_sound(capture: Path) -> Path | None:
    """The sound file of the same name beside a capture, or the only one in its folder; None without one.

    Raises
    ------
    InputError
        There are several.
    """
    beside = sorted(file for file in capture.parent.iterdir() if file.suffix.lower() in SOUND_SUFFIXES)
    found = [file for file in beside if file.stem == capture.stem and file != capture] or beside
    if len(found) > 1:
        raise InputError(
            f"there are {len(found)} sound files beside {capture.name}; give one of them the capture's name"
        )
    return found[0] if found else None
