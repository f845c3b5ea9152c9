"""Reading of a folder of videos and facial captures as input of the decomposition."""

from pathlib import Path

import numpy as np

from corpus_tools.decomposition.capture import FaceRecording
from corpus_tools.decomposition.capture_files import CAPTURE_SUFFIXES, MarkerOptions, read_capture_file
from corpus_tools.parallel import map_unordered
from corpus_tools.recordings.folder import MANIFEST, VIDEO_SUFFIXES
from corpus_tools.recordings.limits import (
    check_limits,
    head_turn_deg,
    picture_measures,
)
from corpus_tools.recordings.observe import Refusal
from corpus_tools.recordings.sound import SOUND_RATE
from corpus_tools.recordings.video import CachedTracker
from corpus_tools.run_options import RunOptions
from lexicon.errors import DataError, InputError
from lexicon.values.files import check_regular_file
from tts2face.models.face import Face
from tts2face.types import Progress, Waveform
from tts2face.video.media import read_sound
from tts2face.video.networks import find_bundle
from tts2face.video.pose import head_angles, remove_pose
from tts2face.video.resampling import resample_to_grid, trim_and_fill


def read_video_recording(video: Path, tracker: CachedTracker) -> FaceRecording:
    """The face in a video, from the first to the last frame with a face, and its sound."""
    tracked = tracker.track(video)
    points, first = resample_to_grid(tracked.tracking.points, tracked.times, tracked.fps)
    filled, start, n_filled = trim_and_fill(points, tracked.fps)
    posed = remove_pose(filled, tracked.fps)
    angles = head_angles(posed.rotations)
    check_limits(
        picture_measures(tracked.n_faces, tracked.changes, tracked.times) | {"turn_deg": head_turn_deg(angles)}
    )
    place = posed.translations - np.median(posed.translations, axis=0)
    first_frame = (first + start) / tracked.fps
    return FaceRecording(
        name=video.stem,
        fps=tracked.fps,
        landmarks=posed.landmarks,
        head=np.column_stack([angles, place]).astype(np.float32),
        sound=read_sound_span(video, first_frame, len(filled) / tracked.fps),
        notes=(f"{n_filled} frames without a face were interpolated",) if n_filled else (),
    )


def read_sound_span(video: Path, start: float, seconds: float) -> Waveform:
    """Sound of a video from `start`; silence before the video's sound."""
    sound = read_sound(video, SOUND_RATE)
    samples = np.zeros(round(seconds * sound.rate), np.float32)
    shift = round(start * sound.rate)
    source = sound.samples[max(shift, 0) :][: len(samples) - max(-shift, 0)]
    samples[max(-shift, 0) :][: len(source)] = source
    return Waveform(samples, sound.rate)


def read_recordings(
    recordings: Path, face: Face, markers: MarkerOptions, run_options: RunOptions, on_progress: Progress
) -> tuple[list[FaceRecording], list[Refusal]]:
    """Recordings and refusals, each sorted by name.

    Raises
    ------
    InputError
        There is no recording.
    BackendError
        The landmark models are missing, the cache cannot be written, or a process died.
    """
    files = find_recording_files(recordings)
    jobs = min(run_options.n_processes(), len(files))
    model = find_bundle(run_options.model) if any(file.suffix.lower() in VIDEO_SUFFIXES for file in files) else None
    ready = (run_options.folder(), model, face, markers)
    captured: list[FaceRecording] = []
    refused: list[Refusal] = []
    for number, (_, outcome) in enumerate(map_unordered(files, _FileReader, ready, jobs), start=1):
        if isinstance(outcome, Refusal):
            refused.append(outcome)
        else:
            captured.append(outcome)
        on_progress(number, len(files))
    return sorted(captured, key=lambda recording: recording.name), sorted(refused, key=lambda recording: recording.name)


def find_recording_files(recordings: Path) -> list[Path]:
    """Videos and captures in a folder and its subfolder ``clips``, or the given file."""
    known = VIDEO_SUFFIXES | CAPTURE_SUFFIXES
    if recordings.is_file() and recordings.suffix.lower() in known:
        return [recordings]
    folders = [recordings, recordings / "clips"]
    found = [file for folder in folders if folder.is_dir() for file in folder.iterdir() if file.suffix.lower() in known]
    if not found:
        raise InputError(
            f"{recordings} contains no video and no capture ({', '.join(sorted(known))}); give a folder of them"
        )
    return sorted(file for file in found if file.name != MANIFEST)


class _FileReader:
    def __init__(self, cache: Path, model: Path | None, face: Face, marker_options: MarkerOptions) -> None:
        self._tracker = CachedTracker(cache, model) if model is not None else None
        self._face, self._marker_options = face, marker_options

    def __call__(self, file: Path) -> FaceRecording | Refusal:
        """A recording, or the reason for its refusal."""
        try:
            check_regular_file(file)
            if self._tracker is not None and file.suffix.lower() in VIDEO_SUFFIXES:
                return read_video_recording(file, self._tracker)
            return read_capture_file(file, self._face, options=self._marker_options)
        except DataError as reason:
            return Refusal(file.stem, str(reason), file, 0.0)
