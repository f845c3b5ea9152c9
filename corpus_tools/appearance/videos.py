"""Training recordings of an appearance model, with pictures and landmarks."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from corpus_tools.recordings.observation import Observation
from corpus_tools.recordings.video import CachedTracker
from tts2face.video.media import read_frames
from tts2face.video.resampling import fill_gaps, resample_to_grid


@dataclass(frozen=True, slots=True, eq=False)
class AppearanceRecording:
    """One training recording of an appearance model.

    ``points`` (T, 478, 2) pixels and ``landmarks`` (T, 478, 3) mm; frame i is the instant ``start + i / fps`` of the
    video; ``shape`` (T, M) are parameters of the talker's shape model.
    """

    video: Path
    start: float
    fps: float
    points: NDArray[np.float32]
    landmarks: NDArray[np.float32]
    shape: NDArray[np.float32]

    def pictures(self) -> Iterator[NDArray[np.uint8]]:
        """The picture (H, W, 3) shown at each frame's instant; the file's own rate may change."""
        n_given, n_frames, shown = 0, len(self.points), None
        for picture in read_frames(self.video):
            while (
                shown is not None and n_given < n_frames and picture.time > self._frame_time(n_given) + 0.5 / self.fps
            ):
                yield shown
                n_given += 1
            if n_given == n_frames:
                return
            shown = picture.pixels
        while shown is not None and n_given < n_frames:
            yield shown
            n_given += 1

    def _frame_time(self, frame: int) -> float:
        return self.start + frame / self.fps


def build_appearance_recording(
    observation: Observation, shape: NDArray[np.float32], tracker: CachedTracker
) -> AppearanceRecording:
    """An observed recording with its landmarks in the picture; tracking is read from the cache.

    Parameters
    ----------
    shape : (T, M)
        Parameters of the talker's shape model.

    Raises
    ------
    DataError
        The video can no longer be read.
    """
    tracked = tracker.track(observation.video)
    fps, first_frame = (
        observation.fps,
        observation.quality.cut,
    )  # the rate that all recordings have, maybe not the video's
    points, first = resample_to_grid(tracked.tracking.points, tracked.times, fps)
    start = round(first_frame * fps) - first
    here, _ = fill_gaps(points[start : start + len(observation.landmarks)], fps)
    return AppearanceRecording(observation.video, first_frame, fps, here[:, :, :2].copy(), observation.landmarks, shape)
