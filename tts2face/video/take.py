"""A take: what a performer's face and head do in a video, frame by frame, ready to drive any face."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from tts2face.types import HEAD_CHANNELS, Trajectory
from tts2face.video.blendshapes import BLENDSHAPES, BlendshapeReader
from tts2face.video.frame_grid import resample_to_grid
from tts2face.video.media import read_frames, read_media_info
from tts2face.video.pose import head_angles, remove_pose
from tts2face.video.streaming_tracker import StreamingTracker, TrackedFrame

MAX_COUNTS_WITH_TWO_FACES = 1  # a picture on the wall may be taken for a face once
MIN_TRACKED_SHARE = 0.5  # of the frames must show a face
PROFILE_RAD = 0.8  # median turn beyond which landmarks of the far side are guessed

Progress = Callable[[int, int], None]


@dataclass(frozen=True, slots=True, eq=False)
class Take:
    """T frames of a performer; frame i is the instant i / fps of the video's clock.

    Parameters
    ----------
    landmarks : (T, 478, 3)
        Millimetres, head pose removed; axes as in `tts2face.models.landmarks`.
    head
        `HEAD_CHANNELS` against the take's own middle: a performer sits askew before the camera as she likes.
    scores
        The 52 `BLENDSHAPES` as the network reads them.
    n_guessed
        Frames without a face, bridged from their neighbours.
    """

    landmarks: NDArray[np.float32]
    head: Trajectory
    scores: Trajectory
    n_interpolated: int

    @property
    def fps(self) -> float:
        """Frames per second."""
        return self.head.fps


def read_take(
    video: Path, film: StreamingTracker, reader: BlendshapeReader, *, on_progress: Progress | None = None
) -> Take:
    """The take in a video.

    Parameters
    ----------
    on_progress
        Called with frames read and of all.

    Raises
    ------
    InputError
        There is no such file.
    DataError
        It cannot be read as video, or shows no face, several faces, or one in profile.
    """
    facts = read_media_info(video)
    fps, of = facts.fps, max(1, round(facts.duration * facts.fps))
    found: list[TrackedFrame] = []
    n_crowded = 0
    for sight in film.track(read_frames(video), fps):
        found.append(sight)
        n_crowded += sight.n_faces is not None and sight.n_faces > 1
        if n_crowded > MAX_COUNTS_WITH_TWO_FACES:
            raise DataError(f"{video} shows two faces at {sight.time:.1f} s; crop it so that it shows one person")
        if on_progress:
            on_progress(min(len(found), of), of)
    times, pixels = np.array([sight.time for sight in found]), np.array([sight.points for sight in found])
    seen = np.isfinite(pixels[:, 0, 0])
    if not seen.any():
        raise DataError(f"{video} shows no face; film one from the front, in the light")
    if seen.mean() < MIN_TRACKED_SHARE:
        raise DataError(f"{video} shows a face in {seen.sum()} of {len(seen)} frames; film it from the front")
    scores = np.array([reader.blendshape_scores(points) for points in pixels[seen]])
    points, first = resample_to_grid(_interpolate_frames(pixels[seen], times[seen], times), times, fps)
    read, _ = resample_to_grid(_interpolate_frames(scores, times[seen], times), times, fps)
    points, read = _align_to_start(points, first), _align_to_start(read, first)
    posed = remove_pose(points, fps)
    angles = head_angles(posed.rotations)
    if abs(float(np.median(angles[:, 1]))) > PROFILE_RAD:
        raise DataError(f"{video} shows the face in profile; film it from the front")
    head = np.column_stack([angles, posed.translations])
    head -= np.median(head, axis=0)
    n_guessed = int((~seen).sum())
    return Take(posed.landmarks, Trajectory(HEAD_CHANNELS, head, fps), Trajectory(BLENDSHAPES, read, fps), n_guessed)


def _interpolate_frames(
    values: NDArray[np.float32], known: NDArray[np.float64], times: NDArray[np.float64]
) -> NDArray[np.float32]:
    """Values at `times` from those at `known` times: straight lines between, held at the ends."""
    after = np.clip(np.searchsorted(known, times), 1, max(len(known) - 1, 1))
    if len(known) == 1:
        return np.repeat(values, len(times), axis=0)
    share = np.clip((times - known[after - 1]) / (known[after] - known[after - 1]), 0.0, 1.0)
    share = share.reshape(-1, *[1] * (values.ndim - 1)).astype(np.float32)
    return np.asarray(values[after - 1] * (1 - share) + values[after] * share, np.float32)


def _align_to_start(values: NDArray[np.float32], first: int) -> NDArray[np.float32]:
    """Rows on the video's clock: those before its first picture repeat it, those before 0 are left out."""
    if first >= 0:
        return np.concatenate([np.repeat(values[:1], first, axis=0), values])
    return values[-first:]
