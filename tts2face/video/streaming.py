"""Single-pass face tracking in videos, with the same results as the two passes of `FaceTracker.track`."""

from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.models.landmarks import N_LANDMARKS
from tts2face.processes.threads import Prefetch
from tts2face.video.media import TimedFrame
from tts2face.video.tracking import CROP_SMOOTHING_S, MIN_SCORE, Crop, FaceTracker, jittered_crops, smooth_crops

MAX_SIDE_PX = 1280  # longer side; faces in larger pictures exceed the networks' input size in any case
SMOOTHING_REACH = 4.0  # standard deviations at which the smoothing kernel of the crops is truncated
FACE_COUNT_INTERVAL_S = 0.5  # between counts of the faces in a picture
CHANGE_STEP = 2  # every second pixel of every second row is compared with the previous picture
MAX_PREFETCHED_FRAMES = 4  # pictures that are decoded and followed in advance


@dataclass(frozen=True, slots=True, eq=False)
class TrackedFrame:
    """Tracking result of the picture at `time` seconds.

    Parameters
    ----------
    points : (478, 3)
        Landmarks in pixels as in `Tracking`; NaN without a face.
    score
        Probability that the landmarks lie on a face.
    n_faces
        Number of faces, counted every `FACE_COUNT_INTERVAL_S`; None for pictures in between.
    change
        Mean absolute difference from the previous picture in 8-bit levels; infinite for the first picture.
    """

    time: float
    points: NDArray[np.float32]
    score: float
    n_faces: int | None
    change: float


@dataclass(frozen=True, slots=True, eq=False)
class _CroppedFrame:
    """A picture scaled by `scale` to at most `MAX_SIDE_PX`, and the crop of its face."""

    picture: TimedFrame
    scale: float
    n_faces: int | None
    change: float
    crop: Crop | None = None


class StreamingTracker:
    """Face tracker for videos; holds two sets of networks, since following and reading run in parallel.

    Raises
    ------
    BackendError
        LiteRT, OpenCV or the bundle is missing.
    """

    def __init__(self, model: Path | None = None) -> None:
        self._follower, self._reader = FaceTracker(model), FaceTracker(model)

    def track(self, pictures: Iterable[TimedFrame], fps: float) -> Iterator[TrackedFrame]:
        """Yield the result of each picture in order, with a delay of about 0.6 s, in bounded memory."""
        reach = int(SMOOTHING_REACH * CROP_SMOOTHING_S * fps + 0.5)
        window: deque[_CroppedFrame] = deque()
        at = 0  # index within the window of the next picture to read
        with Prefetch(self._crop_frames(pictures, fps), MAX_PREFETCHED_FRAMES) as followed:
            for found in followed:
                window.append(found)
                if len(window) > at + reach:
                    yield self._read(window, at, fps)
                    at += 1
                if at > reach:
                    window.popleft()
                    at -= 1
            while at < len(window):
                yield self._read(window, at, fps)
                at += 1

    def _crop_frames(self, pictures: Iterable[TimedFrame], fps: float) -> Iterator[_CroppedFrame]:
        waiting: deque[_CroppedFrame] = deque()

        def shrunk() -> Iterator[NDArray[np.uint8]]:
            for found in self._inspect_frames(pictures, max(1, round(FACE_COUNT_INTERVAL_S * fps))):
                waiting.append(found)
                yield found.picture.pixels

        for _, crop in self._follower.follow(shrunk()):
            yield replace(waiting.popleft(), crop=crop)

    def _inspect_frames(self, pictures: Iterable[TimedFrame], every: int) -> Iterator[_CroppedFrame]:
        before = None
        for number, picture in enumerate(pictures):
            small, scale = _shrink(picture.pixels)
            n_faces = len(self._follower.detect_faces(small)) if number % every == 0 else None
            grey = small[::CHANGE_STEP, ::CHANGE_STEP, 1].astype(np.int16)
            change = (
                float(np.abs(grey - before).mean()) if before is not None and before.shape == grey.shape else np.inf
            )
            before = grey
            yield _CroppedFrame(TimedFrame(picture.time, small), scale, n_faces, change)

    def _read(self, window: "deque[_CroppedFrame]", at: int, fps: float) -> TrackedFrame:
        here = window[at]
        crop = smooth_crops([found.crop for found in window], fps)[at]
        points, score = np.full((N_LANDMARKS, 3), np.nan, np.float32), 0.0
        if crop is not None:
            readings = [self._reader.read_crop(here.picture.pixels, near) for near in jittered_crops(crop)]
            score = float(np.mean([score for _, score in readings]))
            if score >= MIN_SCORE:
                points = np.mean([points for points, _ in readings], axis=0, dtype=np.float32)
                points = _enlarge(points, here.scale)
        return TrackedFrame(here.picture.time, points, score, here.n_faces, here.change)


def _shrink(pixels: NDArray[np.uint8]) -> tuple[NDArray[np.uint8], float]:
    """Scale a picture down to at most `MAX_SIDE_PX` along its longer side; returns the picture and the factor."""
    height, width = pixels.shape[:2]
    if max(height, width) <= MAX_SIDE_PX:
        return pixels, 1.0
    import cv2

    scale = MAX_SIDE_PX / max(height, width)
    size = (round(width * scale), round(height * scale))
    small: NDArray[Any] = cv2.resize(pixels, size, interpolation=cv2.INTER_AREA)
    return small.astype(np.uint8, copy=False), scale


def _enlarge(points: NDArray[np.float32], scale: float) -> NDArray[np.float32]:
    """Map points of a picture scaled by `scale` to the original; pixel centres have integer coordinates."""
    if scale == 1.0:
        return points
    centre = np.array([0.5, 0.5, 0.0], np.float32)
    return np.asarray((points + centre) / np.float32(scale) - centre, np.float32)
