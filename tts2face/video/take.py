"""A take: tracked landmarks, head pose and blendshape scores of a performer in a video."""

from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from tts2face.numeric.arrays import interpolate_linear
from tts2face.types import HEAD_CHANNELS, Progress, Trajectory, ignore_progress
from tts2face.video.blendshapes import BLENDSHAPES, BlendshapeReader
from tts2face.video.media import read_frames, read_media_info
from tts2face.video.pose import head_angles, remove_pose
from tts2face.video.resampling import resample_to_grid
from tts2face.video.streaming import StreamingTracker, TrackedFrame

MAX_COUNTS_WITH_TWO_FACES = 1  # tolerates one false detection
MIN_TRACKED_SHARE = 0.5  # least share of frames with a face
PROFILE_RAD = 0.8  # median yaw beyond which the landmarks of the far side are unreliable


@dataclass(frozen=True, slots=True, eq=False)
class Take:
    """T frames of a performer; frame i belongs to the time i / fps of the video.

    Parameters
    ----------
    landmarks : (T, 478, 3)
        Millimetres, head pose removed; axes as in `tts2face.models.landmarks`.
    head : (T, 6)
        `HEAD_CHANNELS` relative to their medians in the take, which compensates an oblique camera.
    scores : (T, 52)
        `BLENDSHAPES` in [0, 1].
    """

    landmarks: NDArray[np.float32]
    head: Trajectory
    scores: Trajectory

    @property
    def fps(self) -> float:
        """Frames per second."""
        return self.head.fps


def read_take(
    video: Path,
    tracker: StreamingTracker,
    reader: BlendshapeReader,
    *,
    seconds: float | None = None,
    on_progress: Progress = ignore_progress,
) -> Take:
    """Track the performer in a video.

    Parameters
    ----------
    seconds
        Length of its beginning that is read; None for all.
    on_progress
        Called with the number of frames tracked and the estimated total.

    Raises
    ------
    InputError
        The file does not exist.
    DataError
        The file cannot be read as video, or shows no face, several faces, or a face in profile.
    """
    info = read_media_info(video)
    read_s = info.duration if seconds is None else min(seconds, info.duration)
    fps, n_frames = info.fps, max(1, round(read_s * info.fps))
    tracked: list[TrackedFrame] = []
    n_crowded = 0
    frames = read_frames(video) if seconds is None else islice(read_frames(video), n_frames)
    for frame in tracker.track(frames, fps):
        tracked.append(frame)
        n_crowded += frame.n_faces is not None and frame.n_faces > 1
        if n_crowded > MAX_COUNTS_WITH_TWO_FACES:
            raise DataError(f"{video} shows two faces at {frame.time:.1f} s; crop it so that it shows one person")
        on_progress(min(len(tracked), n_frames), n_frames)
    times, pixels = np.array([frame.time for frame in tracked]), np.array([frame.points for frame in tracked])
    seen = np.isfinite(pixels[:, 0, 0])
    if not seen.any():
        raise DataError(f"{video} shows no face; film one from the front, in the light")
    if seen.mean() < MIN_TRACKED_SHARE:
        raise DataError(f"{video} shows a face in {seen.sum()} of {len(seen)} frames; film it from the front")
    scores = np.array([reader.blendshape_scores(points) for points in pixels[seen]])
    points, first = resample_to_grid(interpolate_linear(pixels[seen], times[seen], times), times, fps)
    read, _ = resample_to_grid(interpolate_linear(scores, times[seen], times), times, fps)
    points, read = _align_to_start(points, first), _align_to_start(read, first)
    posed = remove_pose(points, fps)
    angles = head_angles(posed.rotations)
    if abs(float(np.median(angles[:, 1]))) > PROFILE_RAD:
        raise DataError(f"{video} shows the face in profile; film it from the front")
    head = np.column_stack([angles, posed.translations])
    head -= np.median(head, axis=0)
    return Take(posed.landmarks, Trajectory(HEAD_CHANNELS, head, fps), Trajectory(BLENDSHAPES, read, fps))


def _align_to_start(values: NDArray[np.float32], first: int) -> NDArray[np.float32]:
    """Rows from time 0 on: the first row is repeated `first` times, or rows before 0 are removed."""
    if first >= 0:
        # the first picture comes later than the sound: its row is held
        return np.concatenate([np.repeat(values[:1], first, axis=0), values])
    return values[-first:]
