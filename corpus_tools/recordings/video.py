"""Tracked landmarks of videos, stored in a cache folder."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from lexicon.values.files import check_regular_file
from tts2face.storage.array_cache import read_kept
from tts2face.storage.content_store import content_hash
from tts2face.storage.tensors import write_tensors
from tts2face.video.media import read_frames, read_media_info
from tts2face.video.networks import MODEL_SHA256
from tts2face.video.tracking import Tracking

if TYPE_CHECKING:
    from tts2face.video.streaming import StreamingTracker
from corpus_tools.recordings.light import measure_light

TRACKING_KIND = "tracking"
LIGHT_KIND = "light"
LIGHT_VERSION = 2  # increased when the measures of light change
TRACKING_VERSION = 3  # increased when tracking gives other values, which invalidates cached ones
NOT_COUNTED = -1  # of the faces of a frame
ShareCallback = Callable[[float], None]  # called with the finished share of a video


@dataclass(frozen=True, slots=True, eq=False)
class TrackedVideo:
    """Tracking results of T frames.

    Parameters
    ----------
    tracking
        Landmarks and their scores.
    times : (T,)
        Seconds.
    fps
        Frame rate stated in the file.
    n_faces : (T,)
        Number of faces in the frame, or `NOT_COUNTED`.
    changes : (T,)
        Mean absolute difference from the previous frame, in 8-bit steps; infinite for the first.
    """

    tracking: Tracking
    times: NDArray[np.float64]
    fps: float
    n_faces: NDArray[np.int8]
    changes: NDArray[np.float32]


class CachedTracker:
    """Landmark tracker with a cache; networks are loaded on first use, and the last video's result stays in memory."""

    def __init__(self, cache: Path, model: Path) -> None:
        self._cache, self._model = cache, model
        self._reader: StreamingTracker | None = None
        self._last: tuple[Path, TrackedVideo] | None = None

    def track(self, video: Path, on_share: ShareCallback | None = None) -> TrackedVideo:
        """Landmarks of a video, from the cache if its content has been tracked.

        Parameters
        ----------
        on_share
            Called with the finished share.

        Raises
        ------
        DataError
            The video cannot be read or contains no frames.
        """
        cached = self._cache / f"{content_key(video)}-{MODEL_SHA256[:8]}-{TRACKING_VERSION}.{TRACKING_KIND}"
        if self._last is None or self._last[0] != cached:
            self._last = None  # frees the memory before the next video is read
            self._last = (
                cached,
                _read_cached_tracking(cached) or self._track_and_cache(video, cached, on_share or (lambda share: None)),
            )
        return self._last[1]

    def light(self, video: Path) -> NDArray[np.float32]:
        """Light of the face (N, 5) as `measure_light` returns it, from the cache if its content has been measured.

        Raises
        ------
        DataError
            The video cannot be read or contains no frames.
        """
        cached = self._cache / f"{content_key(video)}-{MODEL_SHA256[:8]}-{LIGHT_VERSION}.{LIGHT_KIND}"
        kept = read_kept(cached, LIGHT_KIND, LIGHT_VERSION, lambda arrays, _: np.asarray(arrays["light"], np.float32))
        if kept is not None:
            return kept
        tracked = self.track(video)
        found = measure_light(read_frames(video), tracked.tracking.points, tracked.times)
        write_tensors(cached, LIGHT_KIND, LIGHT_VERSION, {"light": found}, {})
        return found

    def _track_and_cache(self, video: Path, cached: Path, on_share: ShareCallback) -> TrackedVideo:
        from tts2face.video.streaming import StreamingTracker

        self._reader = self._reader or StreamingTracker(self._model)
        facts = read_media_info(video)
        frames = []
        for frame in self._reader.track(read_frames(video), facts.fps):
            frames.append(frame)
            on_share(min(frame.time / max(facts.duration, frame.time, 1e-3), 1.0))
        if not frames:
            raise DataError(f"{video} contains no frames; copy or record it again")
        arrays = {
            "points": np.array([frame.points for frame in frames]),
            "scores": np.array([frame.score for frame in frames], np.float32),
            "times": np.array([frame.time for frame in frames]),
            "n_faces": np.array([_stored_face_count(frame.n_faces) for frame in frames], np.int8),
            "changes": np.array([frame.change for frame in frames], np.float32),
        }
        write_tensors(cached, TRACKING_KIND, TRACKING_VERSION, arrays, {"fps": facts.fps})
        return _build_tracked_video(arrays, facts.fps)


def content_key(path: Path) -> str:
    """Cache key of a file's content.

    Raises
    ------
    DataError
        The path is no ordinary file.
    """
    check_regular_file(path)
    # by content: a renamed or moved video is not tracked again
    return content_hash(path)[:32]


def _read_cached_tracking(path: Path) -> TrackedVideo | None:
    """The cached tracking; None if it is missing or damaged."""
    return read_kept(
        path,
        TRACKING_KIND,
        TRACKING_VERSION,
        lambda arrays, header: _build_tracked_video(arrays, float(header["fps"])),
    )


def _build_tracked_video(arrays: Mapping[str, NDArray[Any]], fps: float) -> TrackedVideo:
    tracking = Tracking(arrays["points"], arrays["scores"])
    return TrackedVideo(tracking, arrays["times"], fps, arrays["n_faces"], arrays["changes"])


def _stored_face_count(n_faces: int | None) -> int:
    return NOT_COUNTED if n_faces is None else min(n_faces, np.iinfo(np.int8).max)
