"""Landmarks of a recording, tracked once and kept in a cache folder."""

import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from tts2face.tensors import read_tensors, write_tensors
from tts2face.video.media import media_facts, read_pictures
from tts2face.video.model import MODEL_SHA256
from tts2face.video.track import FaceTracker, Tracking

KIND = "tracking"
TRACKING_VERSION = 1  # rises when tracking gives other numbers, so that cached ones are made again


@dataclass(frozen=True, slots=True, eq=False)
class Watched:
    """What the camera saw: T frames at `times` (T,) seconds with their landmarks; `fps` as the file states it."""

    tracking: Tracking
    times: NDArray[np.float64]
    fps: float


def content_key(path: Path) -> str:
    """Name for everything computed from a file's content alone."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()[:32]


def watched(video: Path, cache: Path, tracker: FaceTracker) -> Watched:
    """Landmarks of a video, from the cache when its content was tracked before.

    Raises
    ------
    DataError
        The video cannot be read.
    """
    kept = cache / f"{content_key(video)}-{MODEL_SHA256[:8]}-{TRACKING_VERSION}.{KIND}"
    if kept.is_file():
        try:
            arrays, header = read_tensors(kept, KIND, TRACKING_VERSION)
            return Watched(Tracking(arrays["points"], arrays["scores"]), arrays["times"], float(header["fps"]))
        except (DataError, KeyError):
            pass  # damaged: made again
    found = track_video(video, tracker)
    arrays = {"points": found.tracking.points, "scores": found.tracking.scores, "times": found.times}
    write_tensors(kept, KIND, TRACKING_VERSION, arrays, {"fps": found.fps})
    return found


def track_video(video: Path, tracker: FaceTracker) -> Watched:
    """Landmarks of a video.

    Raises
    ------
    DataError
        The video cannot be read.
    """
    fps = media_facts(video).fps
    times = np.array([picture.time for picture in read_pictures(video)])
    return Watched(tracker.track(lambda: (picture.pixels for picture in read_pictures(video)), fps), times, fps)
