"""Landmarks of a film read as it runs: one pass over the pictures, the numbers of `FaceTracker.track`."""

from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.models.landmarks import N_LANDMARKS
from tts2face.prefetch import Prefetch
from tts2face.video.media import TimedFrame
from tts2face.video.track import CROP_SMOOTHING_S, MIN_SCORE, Crop, FaceTracker, jittered_crops, smooth_crops

MAX_SIDE_PX = 1280  # along the longer side; a face in a larger picture is larger than the networks' input anyway
SMOOTHING_REACH = 4.0  # standard deviations over which squares are smoothed
FACE_COUNT_INTERVAL_S = 0.5  # between looks for further faces
CHANGE_STEP = 2  # every second pixel of every second row tells whether a picture differs from the one before
MAX_PREFETCHED_FRAMES = 4  # pictures that are decoded and followed ahead


@dataclass(frozen=True, slots=True, eq=False)
class TrackedFrame:
    """What one picture shows, at `time` seconds.

    Parameters
    ----------
    points : (478, 3)
        Pixels of the picture as `Tracking` has them; NaN without a face.
    score
        Probability that the landmarks lie on a face.
    n_faces
        Faces in the picture, counted every `FACE_COUNT_INTERVAL_S`; None where they were not counted.
    change
        Mean difference from the picture before, in steps of 8 bits; infinite for the first.
    """

    time: float
    points: NDArray[np.float32]
    score: float
    n_faces: int | None
    change: float


@dataclass(frozen=True, slots=True, eq=False)
class _CroppedFrame:
    """A picture of at most `MAX_SIDE_PX`, `scale` of the one it was made from, and the face's square in it."""

    picture: TimedFrame
    scale: float
    n_faces: int | None
    change: float
    crop: Crop | None = None


class StreamingTracker:
    """Reads the landmarks of films; needs two sets of networks, for following and reading go side by side.

    Raises
    ------
    BackendError
        LiteRT, OpenCV or the bundle is missing.
    """

    def __init__(self, model: Path | None = None) -> None:
        self._follower, self._reader = FaceTracker(model), FaceTracker(model)

    def track(self, pictures: Iterable[TimedFrame], fps: float) -> Iterator[TrackedFrame]:
        """What each picture shows in turn, some 0.6 s behind, in memory that does not grow."""
        reach = int(SMOOTHING_REACH * CROP_SMOOTHING_S * fps + 0.5)
        window: deque[_CroppedFrame] = deque()
        at = 0  # place in the window of the picture to read next
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
            n_faces = self._follower.count(small) if number % every == 0 else None
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
    """A picture of at most `MAX_SIDE_PX` along its longer side, and its size over that of the picture given."""
    height, width = pixels.shape[:2]
    if max(height, width) <= MAX_SIDE_PX:
        return pixels, 1.0
    import cv2

    scale = MAX_SIDE_PX / max(height, width)
    size = (round(width * scale), round(height * scale))
    small: NDArray[Any] = cv2.resize(pixels, size, interpolation=cv2.INTER_AREA)
    return small.astype(np.uint8, copy=False), scale


def _enlarge(points: NDArray[np.float32], scale: float) -> NDArray[np.float32]:
    """Points of a shrunk picture in the picture that it was made from; pixel centres lie at whole numbers."""
    if scale == 1.0:
        return points
    centre = np.array([0.5, 0.5, 0.0], np.float32)
    return np.asarray((points + centre) / np.float32(scale) - centre, np.float32)
