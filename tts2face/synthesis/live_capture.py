"""A person before a camera drives a face while she moves; her first seconds teach how she moves."""

import threading
from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType

import numpy as np
from numpy.typing import NDArray

from tts2face.models.face import Face
from tts2face.retargeting.performer import PerformerRetargeter, build_performer_retargeter
from tts2face.types import Trajectory
from tts2face.video.blendshapes import BLENDSHAPES, BlendshapeReader
from tts2face.video.media import TimedFrame
from tts2face.video.pose import head_angles, remove_pose
from tts2face.video.track import FaceTracker

CALIBRATION_S = 5.0  # in which lips close and open, and eyes blink
MIN_CALIBRATION_FRAMES = 40  # frames with a face
SCALE_WINDOW_S = 2.0  # over which the size of the face is averaged


@dataclass(frozen=True, slots=True, eq=False)
class LivePose:
    """What a face shows at one moment: ``weights`` (K,) of its shapes and ``head`` (6,) as `HEAD_CHANNELS`."""

    weights: NDArray[np.float32]
    head: NDArray[np.float32]


def track_poses(
    pictures: Iterable[TimedFrame], face: Face, tracker: FaceTracker, reader: BlendshapeReader, fps: float
) -> Iterator[LivePose | None]:
    """A pose for each picture as soon as it comes; None while the person is learnt, or cannot be seen.

    Parameters
    ----------
    fps
        About how many pictures come each second.

    Raises
    ------
    DataError
        The face lacks landmarks or shapes.
    """
    learning, ready = _Calibrator(), None
    recent: deque[NDArray[np.float32]] = deque(maxlen=max(2, round(SCALE_WINDOW_S * fps)))
    waiting: deque[TimedFrame] = deque()
    for (points, _), _ in tracker.follow(_queue_frames(pictures, waiting)):
        time = waiting.popleft().time
        if not np.isfinite(points[0, 0]):
            yield None
            continue
        recent.append(points)
        scores = reader.blendshape_scores(points)
        if ready is None:
            learning.add(time, points, scores)
            ready = learning.done(face, fps)
            yield None
        else:
            yield ready.pose(np.array(recent), scores, fps)


@dataclass(frozen=True, slots=True, eq=False)
class _Calibration:
    """A person who was learnt: the way from her to the face, and how her head stood."""

    way: PerformerRetargeter
    head: NDArray[np.float64]

    def pose(self, recent: NDArray[np.float32], scores: NDArray[np.float32], fps: float) -> LivePose:
        """The pose of the last of the recent landmarks (T, 478, 3) in pixels."""
        posed = remove_pose(recent, fps)
        now = Trajectory(BLENDSHAPES, scores[None], fps)
        weights = self.way.weights(posed.landmarks[-1:], now).values[0]
        head = np.concatenate([head_angles(posed.rotations[-1:])[0], posed.translations[-1]]) - self.head
        head[5] = 0.0  # sizes of moments far apart are not compared
        return LivePose(weights, head.astype(np.float32))


class _Calibrator:
    """The first seconds of a person."""

    def __init__(self) -> None:
        self._times: list[float] = []
        self._points: list[NDArray[np.float32]] = []
        self._scores: list[NDArray[np.float32]] = []

    def add(self, time: float, points: NDArray[np.float32], scores: NDArray[np.float32]) -> None:
        """Take one more frame."""
        self._times.append(time)
        self._points.append(points)
        self._scores.append(scores)

    def done(self, face: Face, fps: float) -> _Calibration | None:
        """The person, as soon as enough of her was seen."""
        if len(self._times) < MIN_CALIBRATION_FRAMES or self._times[-1] - self._times[0] < CALIBRATION_S:
            return None
        posed = remove_pose(np.array(self._points), fps)
        scores = Trajectory(BLENDSHAPES, np.array(self._scores), fps)
        head = np.column_stack([head_angles(posed.rotations), posed.translations])
        return _Calibration(build_performer_retargeter(posed.landmarks, scores, face), np.median(head, axis=0))


class LiveCapture:
    """A person who is watched in a thread of its own; a window asks for what she did last.

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
        """Begin to watch."""
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Stop watching."""
        self._stopped = True
        self._thread.join()

    def latest_pose(self) -> tuple[NDArray[np.float32], NDArray[np.float32]] | None:
        """Weights and head of the last moment, once; None where nothing new has come."""
        last, self._last = self._last, None
        return None if last is None else (last.weights, last.head)

    def _run(self) -> None:
        for pose in self._poses:
            self._last = pose or self._last
            if self._stopped:
                return


def _queue_frames(pictures: Iterable[TimedFrame], waiting: "deque[TimedFrame]") -> Iterator[NDArray[np.uint8]]:
    for picture in pictures:
        waiting.append(picture)
        yield picture.pixels
