"""Reading of a folder of videos and facial captures as input of the decomposition.

Facial capture files: Live Link Face tables, and markers as C3D or tables.

Check of one take of gestures before a style is learnt from it: what would be refused, what is weak.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from corpus_tools.decomposition.capture import FaceRecording, read_capture_sound
from corpus_tools.decomposition.markers import DEFAULT_MARKER_TABLE, read_marker_recording, read_marker_set
from corpus_tools.parallel import map_unordered
from corpus_tools.recordings.folder import MANIFEST, VIDEO_SUFFIXES
from corpus_tools.recordings.limits import (
    REFUSAL,
    UNUSABLE,
    WARNING,
    Finding,
    check_limits,
    head_turn_deg,
    landmark_measures,
    light_measures,
    limit_findings,
    picture_measures,
)
from corpus_tools.recordings.observe import Refusal
from corpus_tools.recordings.sound import SOUND_RATE
from corpus_tools.recordings.video import CachedTracker
from corpus_tools.run_options import RunOptions
from lexicon.errors import DataError, InputError
from lexicon.values.fields import check_fields
from lexicon.values.files import check_regular_file
from tts2face.face.deformation import moved_landmarks, rest_landmarks
from tts2face.lips.performer import match_shapes
from tts2face.models.face import Face
from tts2face.types import Progress, Trajectory, Waveform
from tts2face.video.livelink import FaceCapture, read_livelink
from tts2face.video.media import read_sound
from tts2face.video.networks import find_bundle
from tts2face.video.pose import head_angles, remove_pose
from tts2face.video.resampling import resample_to_grid, trim_and_fill

CAPTURE_SUFFIXES = frozenset({".c3d", ".csv"})
LIVELINK_FIRST_COLUMN = "timecode"  # first column of a Live Link Face table


@dataclass(frozen=True, slots=True)
class MarkerOptions:
    """Options of marker files: the table of the marker set, a recording of the person at rest, frame rate of tables."""

    marker_table: Path = DEFAULT_MARKER_TABLE
    neutral: Path | None = None
    fps: float | None = None

    def __post_init__(self) -> None:
        """Refuse values of other types (`InputError`)."""
        check_fields(self)


def is_livelink(path: Path) -> bool:
    """Whether a file begins like a Live Link Face table."""
    if path.suffix.lower() != ".csv" or not path.is_file():
        return False
    with path.open("rb") as file:
        return file.read(64).decode("utf-8-sig", errors="replace").lower().startswith(LIVELINK_FIRST_COLUMN)


def read_capture_file(path: Path, face: Face, *, options: MarkerOptions | None = None) -> FaceRecording:
    """A facial capture as landmarks; its sound is that of the file, or of a file of the same name.

    Raises
    ------
    InputError
        There is no such file, or it is of another kind.
    DataError
        It is damaged; or as `read_marker_recording` says.
    """
    if path.suffix.lower() not in CAPTURE_SUFFIXES:
        raise InputError(
            f"{path.name} is not a facial capture; supported suffixes are {', '.join(sorted(CAPTURE_SUFFIXES))}"
        )
    if is_livelink(path):
        return read_livelink_recording(path, face)
    options = options or MarkerOptions()
    return read_marker_recording(
        path, face, read_marker_set(options.marker_table), neutral=options.neutral, fps=options.fps
    )


# A feature is missing if no channel with one of these prefixes moves.
FEATURE_CHANNELS = {"gaze": ("eyeLook",), "blink": ("eyeBlink",), "brows": ("brow",), "cheeks": ("cheek", "nose")}


def read_livelink_recording(path: Path, face: Face) -> FaceRecording:
    """A Live Link capture in the size of `face`; sound as in `read_capture_sound`.

    Raises
    ------
    InputError
        There is no such file.
    DataError
        It is damaged, or the face lacks landmarks.
    """
    capture = read_livelink(path)
    motion = match_shapes(capture.weights, face)
    return FaceRecording(
        name=path.stem,
        fps=capture.weights.fps,
        landmarks=moved_landmarks(face, motion),
        head=np.asarray(capture.head.values, np.float32),
        sound=read_capture_sound(path),
        rest=rest_landmarks(face).astype(np.float32),
        eyes=eye_motion(face, motion),
        missing_features=_missing_features(capture),
    )


def eye_motion(face: Face, motion: Trajectory) -> NDArray[np.float32]:
    """(T, 4) closures of both lids, and pitch and yaw of the eyes, from weights (T, K) of a face's shapes.

    Lids are closed at weight 1, independent of the geometry of the face.
    """
    at = {name: number for number, name in enumerate(face.shape_names)}
    lids = [motion.values[:, at[f"eyeBlink{side}"]] for side in ("Left", "Right")]
    turned = np.zeros((len(motion), 2))
    for eye in face.eyes:
        for name, turn in eye.turns.items():
            turned += motion.values[:, at[name], None] * turn[:2] / len(face.eyes)
    return np.column_stack([*lids, turned]).astype(np.float32)


def _missing_features(capture: FaceCapture) -> frozenset[str]:
    """Features whose channels are missing or never move."""
    moving = [
        name for name, values in zip(capture.weights.channels, capture.weights.values.T, strict=True) if np.ptp(values)
    ]
    missing = {
        feature for feature, begins in FEATURE_CHANNELS.items() if not any(name.startswith(begins) for name in moving)
    }
    if not capture.head.values.any():
        missing.add("head")
    return frozenset(missing)


def read_video_recording(video: Path, tracker: CachedTracker) -> FaceRecording:
    """The face in a video, from the first to the last frame with a face, and its sound.

    Raises
    ------
    DataError
        The video cannot be read, shows no face, or is unsuitable; the message states the reason.
    """
    tracked = tracker.track(video)
    points, first = resample_to_grid(tracked.tracking.points, tracked.times, tracked.fps)
    filled, start, n_filled = trim_and_fill(points, tracked.fps)
    posed = remove_pose(filled, tracked.fps)
    angles = head_angles(posed.rotations)
    check_limits(
        picture_measures(tracked.n_faces, tracked.changes, tracked.times) | {"turn_deg": head_turn_deg(angles)}
    )
    place = posed.translations - np.median(posed.translations, axis=0)
    begin = (first + start) / tracked.fps
    return FaceRecording(
        name=video.stem,
        fps=tracked.fps,
        landmarks=posed.landmarks,
        head=np.column_stack([angles, place]).astype(np.float32),
        sound=read_sound_span(video, begin, len(filled) / tracked.fps),
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


def read_recordings(
    recordings: Path, face: Face, markers: MarkerOptions, run_options: RunOptions, on_progress: Progress | None
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
    for number, outcome in enumerate(_read_files(files, ready, jobs), start=1):
        if isinstance(outcome, Refusal):
            refused.append(outcome)
        else:
            captured.append(outcome)
        if on_progress:
            on_progress(number, len(files))
    return sorted(captured, key=lambda one: one.name), sorted(refused, key=lambda one: one.name)


def find_recording_files(recordings: Path) -> list[Path]:
    """Videos and captures in a folder and its subfolder ``clips``, or the given file.

    Raises
    ------
    InputError
        There is none.
    """
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


WorkerInputs = tuple[Path, Path | None, Face, MarkerOptions]
FileOutcome = FaceRecording | Refusal


def _read_files(files: Sequence[Path], ready: WorkerInputs, jobs: int) -> Iterator[FileOutcome]:
    if jobs > 1:
        yield from (outcome for _, outcome in map_unordered(files, _read_file, _start_worker, ready, jobs))
        return
    worker = _FileReader(*ready)
    for file in files:
        yield worker.read(file)


class _FileReader:
    def __init__(self, cache: Path, model: Path | None, face: Face, marker_options: MarkerOptions) -> None:
        self._tracker = CachedTracker(cache, model) if model is not None else None
        self._face, self._marker_options = face, marker_options

    def read(self, file: Path) -> FileOutcome:
        """A recording, or the reason for its refusal."""
        try:
            check_regular_file(file)
            if self._tracker is not None and file.suffix.lower() in VIDEO_SUFFIXES:
                return read_video_recording(file, self._tracker)
            return read_capture_file(file, self._face, options=self._marker_options)
        except DataError as reason:
            return Refusal(file.stem, str(reason), file, 0.0)


_worker: list[_FileReader] = []  # of this process; filled once by the pool


def _start_worker(*ready: Any) -> None:
    _worker.append(_FileReader(*ready))


def _read_file(file: Path) -> FileOutcome:
    return _worker[0].read(file)


LEAST_S = 2.5  # the fields compare 10 preceding frames (0.33 s) and look 6 frames ahead: less leaves no choice
GOOD_S = 20.0  # chosen, not measured: some eight phrases, so that a clip need not repeat one motion
LEAST_SEEN = 0.8  # share of frames with a face below which a warning is given
LIPS_ONLY = frozenset({"jitter"})  # measures of the lips, which gestures do not use


@dataclass(frozen=True, slots=True)
class TakeReport:
    """Seconds of a take that show the face, and findings, refusals first; without findings it is good."""

    seconds: float
    findings: tuple[Finding, ...]


def check_gesture_take(take: Path, run_options: RunOptions, on_share: Callable[[float], None]) -> TakeReport:
    """Check a video or a Live Link table; tracked landmarks are cached for the building of the style.

    Raises
    ------
    InputError
        There is no such file, or it is neither.
    BackendError
        A package or the landmark models are missing.
    """
    suffix = take.suffix.lower()
    try:
        if suffix in CAPTURE_SUFFIXES and is_livelink(take):
            weights = read_livelink(take).weights
            seconds, found = weights.duration, list[Finding]()
        elif suffix in VIDEO_SUFFIXES:
            seconds, found = _check_video(
                take, CachedTracker(run_options.folder(), find_bundle(run_options.model)), on_share
            )
        else:
            raise InputError(f"{take.name} is neither a video nor a Live Link Face table; choose another file")
    except DataError as reason:
        return TakeReport(0.0, (Finding(REFUSAL, UNUSABLE, str(reason)),))
    return TakeReport(
        seconds, tuple(sorted([*found, *_length_findings(seconds)], key=lambda one: one.severity != REFUSAL))
    )


def _check_video(take: Path, tracker: CachedTracker, on_share: Callable[[float], None]) -> tuple[float, list[Finding]]:
    tracked = tracker.track(take, on_share)
    seen = np.isfinite(tracked.tracking.points[:, 0, 0])
    if not seen.any():
        raise DataError("no face is found; sit in front of the camera, in the light")
    points, _ = resample_to_grid(tracked.tracking.points, tracked.times, tracked.fps)
    filled, _, _ = trim_and_fill(points, tracked.fps)
    posed = remove_pose(filled, tracked.fps)
    measures = (
        picture_measures(tracked.n_faces, tracked.changes, tracked.times)
        | {"turn_deg": head_turn_deg(head_angles(posed.rotations))}
        | landmark_measures(filled, posed.landmarks)
        | light_measures(tracker.light(take), -np.inf, np.inf)
    )
    found = list(limit_findings({name: value for name, value in measures.items() if name not in LIPS_ONLY}))
    share = float(seen.mean())
    if share < LEAST_SEEN:
        message = f"the face is seen in {share:.0%} of the pictures, limit {LEAST_SEEN:.0%}; stay in the picture"
        found.append(Finding(WARNING, "seen", message, share, LEAST_SEEN))
    return len(filled) / tracked.fps, found


def _length_findings(seconds: float) -> list[Finding]:
    if seconds < LEAST_S:
        message = f"the face is seen for {seconds:.1f} s, limit {LEAST_S:g} s; record a longer take"
        return [Finding(REFUSAL, "seconds", message, seconds, LEAST_S)]
    if seconds < GOOD_S:
        message = f"the take has {seconds:.1f} s; gestures of {GOOD_S:g} s and more repeat less"
        return [Finding(WARNING, "seconds", message, seconds, GOOD_S)]
    return []
