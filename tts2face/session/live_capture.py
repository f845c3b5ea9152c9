"""Poses of a performer before a camera, who moves a face after some seconds of calibration."""

import threading
from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType

import numpy as np
from numpy.typing import NDArray

from tts2face.lips.performer import PerformerRetargeter, build_performer_retargeter
from tts2face.models.face import Face
from tts2face.types import Trajectory
from tts2face.video.blendshapes import BLENDSHAPES, BlendshapeReader
from tts2face.video.media import TimedFrame
from tts2face.video.pose import head_angles, remove_pose
from tts2face.video.tracking import FaceTracker

CALIBRATION_S = 5.0  # long enough for the lips to close and open and the eyes to blink
MIN_CALIBRATION_FRAMES = 40  # frames with a face
SCALE_WINDOW_S = 2.0  # window over which the size of the face is averaged


@dataclass(frozen=True, slots=True, eq=False)
class LivePose:
    """One frame of captured motion: shape weights (K,) and head pose (6,) as `HEAD_CHANNELS`."""

    weights: NDArray[np.float32]
    head: NDArray[np.float32]


def track_poses(
    pictures: Iterable[TimedFrame], face: Face, tracker: FaceTracker, reader: BlendshapeReader, fps: float
) -> Iterator[LivePose | None]:
    """Yield a pose for each picture as it arrives; None during calibration and for pictures without a face.

    Parameters
    ----------
    fps
        Approximate rate of the pictures in Hz.

    Raises
    ------
    DataError
        The face lacks landmarks or shapes.
    """
    calibrator, calibration = _Calibrator(), None
    recent: deque[NDArray[np.float32]] = deque(maxlen=max(2, round(SCALE_WINDOW_S * fps)))
    waiting: deque[TimedFrame] = deque()
    for (points, _), _ in tracker.follow(_queue_frames(pictures, waiting)):
        time = waiting.popleft().time
        if not np.isfinite(points[0, 0]):
            yield None
            continue
        recent.append(points)
        scores = reader.blendshape_scores(points)
        if calibration is None:
            calibrator.add(time, points, scores)
            calibration = calibrator.finish(face, fps)
            yield None
        else:
            yield calibration.pose(np.array(recent), scores, fps)


@dataclass(frozen=True, slots=True, eq=False)
class _Calibration:
    """A calibrated performer: the retargeter from performer to face, and the median head pose (6,)."""

    retargeter: PerformerRetargeter
    head: NDArray[np.float64]

    def pose(self, recent: NDArray[np.float32], scores: NDArray[np.float32], fps: float) -> LivePose:
        """Pose of the last frame of recent landmarks (T, 478, 3) in pixels, with its blendshape scores (52,)."""
        posed = remove_pose(recent, fps)
        now = Trajectory(BLENDSHAPES, scores[None], fps)
        weights = self.retargeter.weights(posed.landmarks[-1:], now).values[0]
        head = np.concatenate([head_angles(posed.rotations[-1:])[0], posed.translations[-1]]) - self.head
        # head channels: three angles, then x, y and z
        head[5] = 0.0  # the distance is relative to the recent frames and drifts over longer times
        return LivePose(weights, head.astype(np.float32))


class _Calibrator:
    """Collects the frames of the first seconds."""

    def __init__(self) -> None:
        self._times: list[float] = []
        self._points: list[NDArray[np.float32]] = []
        self._scores: list[NDArray[np.float32]] = []

    def add(self, time: float, points: NDArray[np.float32], scores: NDArray[np.float32]) -> None:
        """Add one frame: time in seconds, landmarks (478, 3) in pixels, blendshape scores (52,)."""
        self._times.append(time)
        self._points.append(points)
        self._scores.append(scores)

    def finish(self, face: Face, fps: float) -> _Calibration | None:
        """The calibration; None until `CALIBRATION_S` and `MIN_CALIBRATION_FRAMES` are reached."""
        if len(self._times) < MIN_CALIBRATION_FRAMES or self._times[-1] - self._times[0] < CALIBRATION_S:
            return None
        posed = remove_pose(np.array(self._points), fps)
        scores = Trajectory(BLENDSHAPES, np.array(self._scores), fps)
        head = np.column_stack([head_angles(posed.rotations), posed.translations])
        return _Calibration(build_performer_retargeter(posed.landmarks, scores, face), np.median(head, axis=0))


class LiveCapture:
    """Capture in a background thread, from which a window reads the latest pose.

    Raises
    ------
    BackendError
        LiteRT, OpenCV or the landmark models are missing.
    """

    def __init__(self, pictures: Iterable[TimedFrame], face: Face, fps: float, model: Path | None = None) -> None:
        self._poses = track_poses(pictures, face, FaceTracker(model), BlendshapeReader(model), fps)
        self._last: LivePose | None = None
        self._stopped = False
        self._thread = threading.Thread(target=self._run, name="actor", daemon=True)

    def __enter__(self) -> "LiveCapture":
        """Start the capture."""
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Stop the capture and wait for its thread."""
        self._stopped = True
        self._thread.join()

    def latest_pose(self) -> tuple[NDArray[np.float32], NDArray[np.float32]] | None:
        """Shape weights (K,) and head pose (6,) of the latest frame; None if no frame arrived since the last call."""
        last, self._last = self._last, None
        return None if last is None else (last.weights, last.head)

    def _run(self) -> None:
        for pose in self._poses:
            self._last = pose or self._last
            if self._stopped:
                return


def _queue_frames(pictures: Iterable[TimedFrame], waiting: "deque[TimedFrame]") -> Iterator[NDArray[np.uint8]]:
    """Yield the pixels of each picture and append the picture to `waiting`."""
    for picture in pictures:
        waiting.append(picture)
        yield picture.pixels
