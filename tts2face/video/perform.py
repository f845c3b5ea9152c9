"""A take: what a performer's face and head do in a video, frame by frame, ready to drive any face."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from tts2face.types import HEAD_CHANNELS, Trajectory
from tts2face.video.blendshapes import BLENDSHAPES, BlendshapeReader
from tts2face.video.grid import on_grid
from tts2face.video.media import media_facts, read_pictures
from tts2face.video.pose import head_angles, remove_pose
from tts2face.video.track import FaceTracker

LEAST_SEEN = 0.5  # of the frames must show a face
PROFILE_RAD = 0.8  # median turn beyond which landmarks of the far side are guessed

Progress = Callable[[int, int], None]


@dataclass(frozen=True, slots=True, eq=False)
class Take:
    """T frames of a performer; frame i is the instant i / fps of the video's clock.

    Parameters
    ----------
    landmarks : (T, 478, 3)
        Millimetres, head pose removed; axes as in `tts2face.landmarks`.
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
    n_guessed: int

    @property
    def fps(self) -> float:
        """Frames per second."""
        return self.head.fps


def read_take(
    video: Path, tracker: FaceTracker, reader: BlendshapeReader, *, on_progress: Progress | None = None
) -> Take:
    """The take in a video.

    Parameters
    ----------
    on_progress
        Called with frames read and of all; the tracker reads every frame twice.

    Raises
    ------
    InputError
        There is no such file.
    DataError
        It cannot be read as video, or shows no face, several faces, or one in profile.
    """
    fps = media_facts(video).fps
    times = np.array([picture.time for picture in read_pictures(video)])
    _require_one_face(video, tracker, len(times))
    n_read = 0

    def pictures() -> Iterator[NDArray[np.uint8]]:
        nonlocal n_read
        for picture in read_pictures(video):
            yield picture.pixels
            n_read += 1
            if on_progress:
                on_progress(n_read, 2 * len(times))

    tracking = tracker.track(pictures, fps)
    seen = ~tracking.is_missing
    if seen.mean() < LEAST_SEEN:
        raise DataError(f"{video} shows a face in {seen.sum()} of {len(seen)} frames; film it from the front")
    scores = np.array([reader.blendshape_scores(points) for points in tracking.points[seen]])
    points, first = on_grid(_bridged(tracking.points[seen], times[seen], times), times, fps)
    read, _ = on_grid(_bridged(scores, times[seen], times), times, fps)
    points, read = _from_the_start(points, first), _from_the_start(read, first)
    posed = remove_pose(points, fps)
    angles = head_angles(posed.rotations)
    if abs(float(np.median(angles[:, 1]))) > PROFILE_RAD:
        raise DataError(f"{video} shows the face in profile; film it from the front")
    head = np.column_stack([angles, posed.shifts])
    head -= np.median(head, axis=0)
    n_guessed = int((~seen).sum())
    return Take(posed.landmarks, Trajectory(HEAD_CHANNELS, head, fps), Trajectory(BLENDSHAPES, read, fps), n_guessed)


def _require_one_face(video: Path, tracker: FaceTracker, n_frames: int) -> None:
    """Refuse a video whose first, middle or last picture shows several faces; a passer-by in one of them is none."""
    looked_at = {0, n_frames // 2, n_frames - 1}
    counts = [tracker.count(picture.pixels) for at, picture in enumerate(read_pictures(video)) if at in looked_at]
    if not counts or max(counts) == 0:
        raise DataError(f"{video} shows no face; film one from the front, in the light")
    if sum(count > 1 for count in counts) * 2 > len(counts):
        raise DataError(f"{video} shows {max(counts)} faces; film or cut it so that one is seen")


def _bridged(
    values: NDArray[np.float32], known: NDArray[np.float64], times: NDArray[np.float64]
) -> NDArray[np.float32]:
    """Values at `times` from those at `known` times: straight lines between, held at the ends."""
    after = np.clip(np.searchsorted(known, times), 1, max(len(known) - 1, 1))
    if len(known) == 1:
        return np.repeat(values, len(times), axis=0)
    share = np.clip((times - known[after - 1]) / (known[after] - known[after - 1]), 0.0, 1.0)
    share = share.reshape(-1, *[1] * (values.ndim - 1)).astype(np.float32)
    return np.asarray(values[after - 1] * (1 - share) + values[after] * share, np.float32)


def _from_the_start(values: NDArray[np.float32], first: int) -> NDArray[np.float32]:
    """Rows on the video's clock: those before its first picture repeat it, those before 0 are left out."""
    if first >= 0:
        return np.concatenate([np.repeat(values[:1], first, axis=0), values])
    return values[-first:]
