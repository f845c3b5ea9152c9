"""Training recordings of an appearance model, with pictures and landmarks.

The plate: selection and encoding of the part of a talker's video on which pictures are drawn.
"""

import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import chain
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from corpus_tools.recordings.observation import Observation
from corpus_tools.recordings.video import CachedTracker
from tts2face.models.landmarks import CHIN, LOWER_LIP_INNER_MID, UPPER_LIP_INNER_MID
from tts2face.video.media import read_frames
from tts2face.video.resampling import fill_gaps, resample_to_grid


@dataclass(frozen=True, slots=True, eq=False)
class AppearanceRecording:
    """One training recording of an appearance model.

    ``points`` (T, 478, 2) pixels and ``landmarks`` (T, 478, 3) mm; frame i is the instant ``begin + i / fps`` of the
    video; ``shape`` (T, M) are parameters of the talker's shape model.
    """

    video: Path
    begin: float
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
        return self.begin + frame / self.fps


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
    fps, begin = observation.fps, observation.quality.cut  # the rate that all recordings have, maybe not the video's
    points, first = resample_to_grid(tracked.tracking.points, tracked.times, fps)
    start = round(begin * fps) - first
    here, _ = fill_gaps(points[start : start + len(observation.landmarks)], fps)
    return AppearanceRecording(observation.video, begin, fps, here[:, :, :2].copy(), observation.landmarks, shape)


MAX_PLATE_FRAMES = 250  # frames; played forwards and backwards its length is not noticeable
NEAR_LOSSLESS = {"crf": "8", "preset": "slow"}


def choose_plate_frames(points: Sequence[NDArray[np.float32]]) -> tuple[int, int, int]:
    """Index of the recording with the least mouth motion and its range of frames, from landmarks (T, N, 2) of each."""

    def motion(places: NDArray[np.float32]) -> float:
        gap = np.linalg.norm(places[:, UPPER_LIP_INNER_MID] - places[:, LOWER_LIP_INNER_MID], axis=1)
        chin = np.linalg.norm(places[:, CHIN] - places[:, UPPER_LIP_INNER_MID], axis=1)
        return float(gap.mean() + chin.std())

    longest = max(len(places) for places in points)
    enough = [number for number, places in enumerate(points) if len(places) >= min(longest, MAX_PLATE_FRAMES) // 2]
    number = min(enough, key=lambda at: motion(points[at][:MAX_PLATE_FRAMES]))
    return number, 0, min(len(points[number]), MAX_PLATE_FRAMES)


def encode_plate_video(pictures: Iterator[NDArray[np.uint8]]) -> NDArray[np.uint8]:
    """Bytes of an MP4 video of (H, W, 3) pictures; odd sides lose their last row or column."""
    import av

    first = next(pictures)
    height, width = (side - side % 2 for side in first.shape[:2])
    store = io.BytesIO()
    with av.open(store, "w", format="mp4") as container:
        stream = container.add_stream("libx264", rate=Fraction(25), options=dict(NEAR_LOSSLESS))
        stream.width, stream.height, stream.pix_fmt = width, height, "yuv444p"
        for picture in chain([first], pictures):
            frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(picture[:height, :width]), format="rgb24")
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    return np.frombuffer(store.getvalue(), np.uint8)
