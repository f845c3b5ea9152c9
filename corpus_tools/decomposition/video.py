"""Recordings of faces from videos as input of the decomposition."""

from pathlib import Path

import numpy as np

from corpus_tools.decomposition.capture import FaceRecording
from corpus_tools.recordings.corpus_audio import SOUND_RATE
from corpus_tools.recordings.corpus_video import CachedTracker
from corpus_tools.recordings.limits import check_limits, head_turn_deg, picture_measures
from lexicon.errors import DataError
from tts2face.types import Waveform
from tts2face.video.frame_grid import face_span, fill_gaps, resample_to_grid
from tts2face.video.media import read_sound
from tts2face.video.pose import head_angles, remove_pose


def read_video_recording(video: Path, tracker: CachedTracker) -> FaceRecording:
    """The face in a video, from the first to the last frame with a face, and its sound.

    Raises
    ------
    DataError
        The video cannot be read, shows no face, or is unsuitable; the message states the reason.
    """
    seen = tracker.track(video)
    points, first = resample_to_grid(seen.tracking.points, seen.times, seen.fps)
    if np.isnan(points).all():
        raise DataError("no frame shows a face")
    start, end = face_span(points)
    filled, n_filled = fill_gaps(points[start:end], seen.fps)
    posed = remove_pose(filled, seen.fps)
    angles = head_angles(posed.rotations)
    check_limits(picture_measures(seen.n_faces, seen.changes, seen.times) | {"turn_deg": head_turn_deg(angles)})
    place = posed.translations - np.median(posed.translations, axis=0)
    begin = (first + start) / seen.fps
    return FaceRecording(
        name=video.stem,
        fps=seen.fps,
        landmarks=posed.landmarks,
        head=np.column_stack([angles, place]).astype(np.float32),
        sound=read_sound_span(video, begin, len(filled) / seen.fps),
        notes=(f"{n_filled} frames without a face were interpolated",) if n_filled else (),
    )


def read_sound_span(video: Path, begin: float, seconds: float) -> Waveform:
    """Sound of a video from `begin`; silence before the video's sound."""
    sound = read_sound(video, SOUND_RATE)
    samples = np.zeros(round(seconds * sound.rate), np.float32)
    shift = round(begin * sound.rate)
    source = sound.samples[max(shift, 0) :][: len(samples) - max(-shift, 0)]
    samples[max(-shift, 0) :][: len(source)] = source
    return Waveform(samples, sound.rate)
