"""A take: tracked landmarks, head pose and blendshape scores of a performer in a video.

Blendshape scores of tracked landmarks: smile, jaw opening, blink and 49 others.

Reader of Live Link Face captures: CSV files with 61 ARKit channels for each frame.
"""

from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError, InputError
from lexicon.values.tables import read_table
from tts2face.models.landmarks import N_LANDMARKS
from tts2face.numeric.arrays import interpolate_columns, interpolate_linear
from tts2face.types import HEAD_CHANNELS, Progress, Trajectory
from tts2face.video.media import read_frames, read_media_info
from tts2face.video.pose import head_angles, remove_pose, resample_to_grid
from tts2face.video.streaming import StreamingTracker, TrackedFrame
from tts2face.video.tracking import find_bundle, load_network

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
        Path of the model bundle; if None, see `tts2face.video.tracking.find_bundle`.

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


MAX_COUNTS_WITH_TWO_FACES = 1  # tolerates one false detection
MIN_TRACKED_SHARE = 0.5  # least share of frames with a face
PROFILE_RAD = 0.8  # median yaw beyond which the landmarks of the far side are unreliable


@dataclass(frozen=True, slots=True, eq=False)
class Take:
    """T frames of a performer; frame i belongs to the time i / fps of the video.

    Parameters
    ----------
    landmarks : (T, 478, 3)
        Millimetres, head pose removed; axes as in `tts2face.models.landmarks`.
    head : (T, 6)
        `HEAD_CHANNELS` relative to their medians in the take, which compensates an oblique camera.
    scores : (T, 52)
        `BLENDSHAPES` in [0, 1].
    """

    landmarks: NDArray[np.float32]
    head: Trajectory
    scores: Trajectory

    @property
    def fps(self) -> float:
        """Frames per second."""
        return self.head.fps


def read_take(
    video: Path,
    tracker: StreamingTracker,
    reader: BlendshapeReader,
    *,
    seconds: float | None = None,
    on_progress: Progress | None = None,
) -> Take:
    """Track the performer in a video.

    Parameters
    ----------
    seconds
        Length of its beginning that is read; None for all.
    on_progress
        Called with the number of frames tracked and the estimated total.

    Raises
    ------
    InputError
        The file does not exist.
    DataError
        The file cannot be read as video, or shows no face, several faces, or a face in profile.
    """
    info = read_media_info(video)
    read_s = info.duration if seconds is None else min(seconds, info.duration)
    fps, n_frames = info.fps, max(1, round(read_s * info.fps))
    tracked: list[TrackedFrame] = []
    n_crowded = 0
    frames = read_frames(video) if seconds is None else islice(read_frames(video), n_frames)
    for frame in tracker.track(frames, fps):
        tracked.append(frame)
        n_crowded += frame.n_faces is not None and frame.n_faces > 1
        if n_crowded > MAX_COUNTS_WITH_TWO_FACES:
            raise DataError(f"{video} shows two faces at {frame.time:.1f} s; crop it so that it shows one person")
        if on_progress:
            on_progress(min(len(tracked), n_frames), n_frames)
    times, pixels = np.array([frame.time for frame in tracked]), np.array([frame.points for frame in tracked])
    seen = np.isfinite(pixels[:, 0, 0])
    if not seen.any():
        raise DataError(f"{video} shows no face; film one from the front, in the light")
    if seen.mean() < MIN_TRACKED_SHARE:
        raise DataError(f"{video} shows a face in {seen.sum()} of {len(seen)} frames; film it from the front")
    scores = np.array([reader.blendshape_scores(points) for points in pixels[seen]])
    points, first = resample_to_grid(interpolate_linear(pixels[seen], times[seen], times), times, fps)
    read, _ = resample_to_grid(interpolate_linear(scores, times[seen], times), times, fps)
    points, read = _align_to_start(points, first), _align_to_start(read, first)
    posed = remove_pose(points, fps)
    angles = head_angles(posed.rotations)
    if abs(float(np.median(angles[:, 1]))) > PROFILE_RAD:
        raise DataError(f"{video} shows the face in profile; film it from the front")
    head = np.column_stack([angles, posed.translations])
    head -= np.median(head, axis=0)
    return Take(posed.landmarks, Trajectory(HEAD_CHANNELS, head, fps), Trajectory(BLENDSHAPES, read, fps))


def _align_to_start(values: NDArray[np.float32], first: int) -> NDArray[np.float32]:
    """Rows from time 0 on: the first row is repeated `first` times, or rows before 0 are removed."""
    if first >= 0:
        return np.concatenate([np.repeat(values[:1], first, axis=0), values])
    return values[-first:]


HEAD_COLUMNS = ("HeadPitch", "HeadYaw", "HeadRoll")
MIN_CAPTURE_FPS, MAX_CAPTURE_FPS = 10.0, 240.0
MAX_CAPTURE_GAP_S = 0.5
TIMECODE_RATES = (24, 25, 30, 50, 60, 120)  # frames in a second of timecode
HEAD_SIGNS = np.array([1.0, -1.0, 1.0])  # as of its eyes: pitch down (EyePitch follows EyeLookDown), yaw to the right


@dataclass(frozen=True, slots=True, eq=False)
class FaceCapture:
    """Weights (T, 52) by ARKit name and head pose (T, 6) with zero translation, at a uniform frame rate."""

    weights: Trajectory
    head: Trajectory


def read_livelink(path: Path) -> FaceCapture:
    """Read a Live Link Face file.

    Raises
    ------
    InputError
        The file does not exist.
    DataError
        The file has another format or is too large, or a row is damaged.
    """
    if not path.is_file():
        raise InputError(f"there is no capture {path}; check the path")
    rows = read_table(path)
    if not rows or rows[0][:1] != ["Timecode"] or "JawOpen" not in rows[0] or len(rows) < 3:
        raise DataError(f"{path} is not a CSV file of Live Link Face: it needs the columns Timecode, JawOpen, ...")
    names, times, values = _parse_rows(path, rows)
    fps = _frame_rate(path, times)
    n_frames = int(np.floor((times[-1] - times[0]) * fps + 0.5)) + 1
    even = times[0] + np.arange(n_frames) / fps
    read = interpolate_columns(values, times, even)
    shapes = [at for at, name in enumerate(names) if not name.startswith(("Head", "LeftEye", "RightEye"))]
    channels = tuple(names[at][0].lower() + names[at][1:] for at in shapes)
    head = np.zeros((n_frames, len(HEAD_CHANNELS)))
    if all(name in names for name in HEAD_COLUMNS):
        turns = read[:, [names.index(name) for name in HEAD_COLUMNS]]
        head[:, :3] = HEAD_SIGNS * (turns - np.median(turns, axis=0))
    return FaceCapture(Trajectory(channels, read[:, shapes], fps), Trajectory(HEAD_CHANNELS, head, fps))


def _parse_rows(path: Path, rows: list[list[str]]) -> tuple[list[str], NDArray[np.float64], NDArray[np.float64]]:
    names = rows[0][2:]
    times, values = [], []
    for number, row in enumerate(rows[1:], start=2):
        if len(row) != len(rows[0]):
            raise DataError(f"line {number} of {path} has {len(row)} columns, not {len(rows[0])}; export it again")
        try:
            times.append(_parse_timecode(row[0]))
            values.append([float(cell) for cell in row[2:]])
        except ValueError as broken:
            raise DataError(f"line {number} of {path} cannot be read ({broken}); export it again") from broken
    if not np.isfinite(values).all():
        raise DataError(f"{path} contains NaN or infinity; export it again")
    seconds, frames = np.array(times).T
    counted = next((rate for rate in TIMECODE_RATES if rate > frames.max()), TIMECODE_RATES[-1])
    return names, seconds + frames / counted, np.array(values)


def _parse_timecode(text: str) -> tuple[float, float]:
    """Seconds and frames of ``hours:minutes:seconds:frames``."""
    hours, minutes, seconds, frames = text.split(":")
    return int(hours) * 3600.0 + int(minutes) * 60.0 + float(seconds), float(frames)


def _frame_rate(path: Path, times: NDArray[np.float64]) -> float:
    steps = np.diff(times)
    if (steps <= 0).any() or steps.max() > MAX_CAPTURE_GAP_S:
        raise DataError(
            f"the times of {path} must increase by at most {MAX_CAPTURE_GAP_S:g} s from row to row; export it again"
        )
    fps = float(np.round(1.0 / np.mean(steps)))
    if not MIN_CAPTURE_FPS <= fps <= MAX_CAPTURE_FPS:
        raise DataError(
            f"{path} has {fps:g} frames per second, not {MIN_CAPTURE_FPS:g} to {MAX_CAPTURE_FPS:g}; export it again"
        )
    return fps
