"""What the camera saw in a recording: landmarks of every frame, tracked once and kept in a cache folder."""

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from lexicon.inputs import check_regular_file
from tts2face.storage.tensors import read_tensors, write_tensors
from tts2face.video.landmark_models import MODEL_SHA256
from tts2face.video.media import read_frames, read_media_info
from tts2face.video.track import Tracking

if TYPE_CHECKING:
    from tts2face.video.streaming_tracker import StreamingTracker

TRACKING_KIND = "tracking"
TRACKING_VERSION = 2  # rises when tracking gives other numbers, so that cached ones are made again
NOT_COUNTED = -1

ShareCallback = Callable[[float], None]  # told the share of a video that is done


@dataclass(frozen=True, slots=True, eq=False)
class TrackedVideo:
    """What the camera saw in T frames.

    Parameters
    ----------
    tracking
        Landmarks and their scores.
    times : (T,)
        Seconds.
    fps
        As the file states it.
    n_faces : (T,)
        Faces in the picture, `NOT_COUNTED` where they were not counted.
    changes : (T,)
        Mean difference from the picture before, in steps of 8 bits; infinite for the first.
    """

    tracking: Tracking
    times: NDArray[np.float64]
    fps: float
    n_faces: NDArray[np.int8]
    changes: NDArray[np.float32]


class CachedTracker:
    """Watches videos; the networks are loaded for the first that is not in the cache, the last one seen is kept."""

    def __init__(self, cache: Path, model: Path) -> None:
        self._cache, self._model = cache, model
        self._reader: StreamingTracker | None = None
        self._last: tuple[Path, TrackedVideo] | None = None

    def track(self, video: Path, tell: ShareCallback | None = None) -> TrackedVideo:
        """What a video shows, from the cache when its content was tracked before.

        Parameters
        ----------
        tell
            Called with the share that is done.

        Raises
        ------
        DataError
            The video cannot be read or holds no picture.
        """
        kept = self._cache / f"{content_key(video)}-{MODEL_SHA256[:8]}-{TRACKING_VERSION}.{TRACKING_KIND}"
        if self._last is None or self._last[0] != kept:
            self._last = None  # two long videos need not lie in memory together
            self._last = (
                kept,
                _read_cached_tracking(kept) or self._track_and_cache(video, kept, tell or (lambda share: None)),
            )
        return self._last[1]

    def _track_and_cache(self, video: Path, kept: Path, tell: ShareCallback) -> TrackedVideo:
        from tts2face.video.streaming_tracker import StreamingTracker

        self._reader = self._reader or StreamingTracker(self._model)
        facts = read_media_info(video)
        sights = []
        for sight in self._reader.track(read_frames(video), facts.fps):
            sights.append(sight)
            tell(min(sight.time / max(facts.duration, sight.time, 1e-3), 1.0))
        if not sights:
            raise DataError(f"{video} holds no picture; copy or record it again")
        arrays = {
            "points": np.array([sight.points for sight in sights]),
            "scores": np.array([sight.score for sight in sights], np.float32),
            "times": np.array([sight.time for sight in sights]),
            "n_faces": np.array([_stored_face_count(sight.n_faces) for sight in sights], np.int8),
            "changes": np.array([sight.change for sight in sights], np.float32),
        }
        write_tensors(kept, TRACKING_KIND, TRACKING_VERSION, arrays, {"fps": facts.fps})
        return _build_tracked_video(arrays, facts.fps)


def content_key(path: Path) -> str:
    """Name for everything computed from a file's content alone.

    Raises
    ------
    DataError
        The path is no ordinary file.
    """
    check_regular_file(path)
    about = path.stat()
    return _content_key(path, about.st_size, about.st_mtime_ns)


@lru_cache(maxsize=1)
def _content_key(path: Path, _size: int, _changed_ns: int) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()[:32]


def _read_cached_tracking(path: Path) -> TrackedVideo | None:
    """What the cache holds; None where it holds nothing or is damaged."""
    if not path.is_file():
        return None
    try:
        arrays, header = read_tensors(path, TRACKING_KIND, TRACKING_VERSION)
        return _build_tracked_video(arrays, float(header["fps"]))
    except (DataError, KeyError):
        return None


def _build_tracked_video(arrays: Mapping[str, NDArray[Any]], fps: float) -> TrackedVideo:
    tracking = Tracking(arrays["points"], arrays["scores"])
    return TrackedVideo(tracking, arrays["times"], fps, arrays["n_faces"], arrays["changes"])


def _stored_face_count(n_faces: int | None) -> int:
    return NOT_COUNTED if n_faces is None else min(n_faces, np.iinfo(np.int8).max)
