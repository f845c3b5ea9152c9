"""Landmarks of a talker in videos and photographs, in the picture and pose-free."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from corpus_tools.recordings.folder import VIDEO_SUFFIXES, find_recordings
from corpus_tools.recordings.video import CachedTracker
from lexicon.errors import DataError, InputError
from tts2face.models.landmarks import (
    lip_opening,
)
from tts2face.numeric.arrays import FloatArray
from tts2face.types import Progress
from tts2face.video.media import read_frames
from tts2face.video.pose import remove_pose

MAX_VIDEOS = 40  # evenly selected from more; means of 40 and 201 videos of GRID s1 differ by 0.05 mm
MAX_CLOSED_GAP = 0.02  # lip gap relative to the eye distance up to which lips count as closed
MIN_CLOSED_FRAMES = 10  # frames; with fewer, those with the smallest gaps are used
OPEN_EYES_PERCENTILE = 50  # of the eye openings: frames above it define lids at rest
RIGHT_LIDS, LEFT_LIDS = (159, 145), (386, 374)  # upper and lower, in the middle of each eye


@dataclass(frozen=True, slots=True, eq=False)
class TrackedPictures:
    """One video or photograph: `points` (T, 478, 3) pixels as tracked, `landmarks` (T, 478, 3) mm without pose.

    Both are NaN in frames without a face; frame i is the i-th of the file. A photograph has its picture with it, a
    mirrored one a small weight, and parted lips an opening (N, 2) between them, pixels, in which there is no skin.
    """

    file: Path
    points: NDArray[np.float32]
    landmarks: NDArray[np.float32]
    pictures: tuple[NDArray[np.uint8], ...] = ()
    weight: float = 1.0
    opening: FloatArray | None = None

    def frames(self) -> Iterator[NDArray[np.uint8]]:
        """The frames (H, W, 3) in their order.

        Raises
        ------
        DataError
            The video can no longer be read.
        """
        return iter(self.pictures) if self.pictures else (frame.pixels for frame in read_frames(self.file))


def find_videos(recordings: Path) -> tuple[Path, ...]:
    """The videos of a folder of recordings, or the given video; at most `MAX_VIDEOS`, evenly selected."""
    if recordings.is_file() and recordings.suffix.lower() not in VIDEO_SUFFIXES:
        raise InputError(f"{recordings} is not a video ({', '.join(sorted(VIDEO_SUFFIXES))}); give one, or a folder")
    if recordings.is_file():
        return (recordings,)
    found = [recording.video for recording in find_recordings(recordings)]
    rows = np.unique(np.linspace(0, len(found) - 1, min(MAX_VIDEOS, len(found))).round().astype(int))
    return tuple(found[row] for row in rows)


def track_videos(videos: Sequence[Path], eyes: CachedTracker, on_progress: Progress) -> tuple[TrackedPictures, ...]:
    """Landmarks of the videos that can be read and show a face."""
    kept, reason = [], ""
    for number, video in enumerate(videos):
        try:
            found = eyes.track(video)
            posed = remove_pose(found.tracking.points, found.fps)
            kept.append(TrackedPictures(video, found.tracking.points, posed.landmarks))
        except DataError as refused:
            reason = f" ({video.name}: {refused})"
        on_progress(number + 1, len(videos))
    if not kept:
        raise DataError(f"no video shows a face{reason}; give videos of one person looking at the camera")
    return tuple(kept)


def resting_landmarks(videos: Sequence[TrackedPictures]) -> FloatArray:
    """(478, 3) mean landmarks in mm of the frames with closed lips and open eyes."""
    landmarks = np.concatenate([video.landmarks for video in videos])
    landmarks = landmarks[np.isfinite(landmarks[:, 0, 0])].astype(np.float64)
    gaps = lip_opening(landmarks)
    limit = max(MAX_CLOSED_GAP, float(np.sort(gaps)[min(MIN_CLOSED_FRAMES, len(gaps)) - 1]))
    open_eyes = eye_opening(landmarks)
    still = gaps <= limit
    wide = still & (open_eyes >= np.percentile(open_eyes[still], OPEN_EYES_PERCENTILE))
    mean: FloatArray = landmarks[wide].mean(axis=0)
    return mean


def eye_opening(landmarks: NDArray[np.floating]) -> FloatArray:
    """(T,) mean height of the two eye openings of (T, 478, 3) landmarks."""
    heights = [np.linalg.norm(landmarks[:, up] - landmarks[:, low], axis=1) for up, low in (RIGHT_LIDS, LEFT_LIDS)]
    return np.asarray(np.mean(heights, axis=0), np.float64)
