"""Landmarks of a film read as it runs: one pass over the pictures, the numbers of `FaceTracker.track`."""

from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from tts2face.ahead import Ahead
from tts2face.landmarks import N_LANDMARKS
from tts2face.video.media import Picture
from tts2face.video.track import CROP_SMOOTHING_S, LEAST_SCORE, Crop, FaceTracker, moved, smoothed_crops

MOST_PIXELS = 1280  # along the longer side; a face in a larger picture is larger than the networks' input anyway
REACH = 4.0  # standard deviations over which squares are smoothed
LOOK_S = 0.5  # between looks for a second face
MOST_LOOKS_WITH_TWO = 2  # a picture on the wall may be taken for a face once
ROOM = 4  # pictures that are decoded and followed ahead


@dataclass(frozen=True, slots=True, eq=False)
class Sight:
    """Landmarks (478, 3) at `time` seconds, in pixels as `Tracking` has them; NaN without a face."""

    time: float
    points: NDArray[np.float32]


class FilmReader:
    """Reads the landmarks of films; needs two sets of networks, for following and reading go side by side.

    Raises
    ------
    BackendError
        LiteRT, OpenCV or the bundle is missing.
    """

    def __init__(self, model: Path | None = None) -> None:
        self._follower, self._reader = FaceTracker(model), FaceTracker(model)

    def sights(self, pictures: Iterable[Picture], fps: float) -> Iterator[Sight]:
        """Landmarks of each picture in turn, some 0.6 s behind, in memory that does not grow.

        Raises
        ------
        DataError
            Two faces are seen.
        """
        reach = int(REACH * CROP_SMOOTHING_S * fps + 0.5)
        window: deque[tuple[Picture, Crop | None]] = deque()
        at = 0  # place in the window of the picture to read next
        with Ahead(self._followed(pictures, fps), ROOM) as followed:
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

    def _followed(self, pictures: Iterable[Picture], fps: float) -> Iterator[tuple[Picture, Crop | None]]:
        waiting: deque[Picture] = deque()
        every, seen_twice = max(1, round(LOOK_S * fps)), 0

        def shrunk() -> Iterator[NDArray[np.uint8]]:
            for number, picture in enumerate(pictures):
                small = Picture(picture.time, _shrunk(picture.pixels))
                nonlocal seen_twice
                if number % every == 0 and self._follower.count(small.pixels) > 1:
                    seen_twice += 1
                    if seen_twice >= MOST_LOOKS_WITH_TWO:
                        raise DataError(
                            f"there are two faces at {picture.time:.1f} s; crop the film so that it shows one person"
                        )
                waiting.append(small)
                yield small.pixels

        for _, crop in self._follower.follow(shrunk()):
            yield waiting.popleft(), crop

    def _read(self, window: "deque[tuple[Picture, Crop | None]]", at: int, fps: float) -> Sight:
        picture = window[at][0]
        crop = smoothed_crops([crop for _, crop in window], fps)[at]
        missing = Sight(picture.time, np.full((N_LANDMARKS, 3), np.nan, np.float32))
        if crop is None:
            return missing
        readings = [self._reader.read_crop(picture.pixels, near) for near in moved(crop)]
        if np.mean([score for _, score in readings]) < LEAST_SCORE:
            return missing
        return Sight(picture.time, np.mean([points for points, _ in readings], axis=0, dtype=np.float32))


def _shrunk(pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    height, width = pixels.shape[:2]
    if max(height, width) <= MOST_PIXELS:
        return pixels
    import cv2

    scale = MOST_PIXELS / max(height, width)
    size = (round(width * scale), round(height * scale))
    small: NDArray[Any] = cv2.resize(pixels, size, interpolation=cv2.INTER_AREA)
    return small.astype(np.uint8, copy=False)
