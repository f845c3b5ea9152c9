"""Observation of one recording: pose-free landmarks, head pose, phones and loudness on one time axis."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from corpus_tools.recordings.folder import Recording, pronounce_recording
from corpus_tools.recordings.limits import (
    check_limits,
    head_turn_deg,
    landmark_measures,
    light_measures,
    limit_warnings,
    picture_measures,
    sound_measures,
)
from corpus_tools.recordings.sound import AlignedSpeech, CachedAligner
from corpus_tools.recordings.video import CachedTracker, TrackedVideo
from lexicon.errors import DataError
from lexicon.sequence import SILENCE, PhoneSequence, WordSpan
from tts2face.sound.praat import intensity
from tts2face.video.pose import PoseFreeLandmarks, head_angles, remove_pose
from tts2face.video.resampling import resample_to_grid, trim_and_fill
from tts2face.video.sound_survey import sound_notes

TRACK_SUFFIX = ".npz"  # of a file of tracked landmarks in place of a video, without sound
TIME_TOLERANCE_S = 1e-6  # seconds
N_NEIGHBOUR_FRAMES = 2.0  # frames around a span that are used to interpolate those in it
MIN_FRAMES = 2
MAX_OUTSIDE_S = (
    0.08  # a phone may end this long after the picture; in noise, aligned words last to the end of the sound
)


@dataclass(frozen=True, slots=True)
class Timing:
    """The common frame rate (None: that of the video), and the delay of a video's sound in seconds."""

    fps: float | None = None
    lag: float = 0.0


@dataclass(frozen=True, slots=True)
class Quality:
    """Quality measures of a recording.

    ``fit`` of the words (`tts2face.sound.alignment.Fit`), lowest face ``score``, ``n_filled`` interpolated frames,
    seconds ``cut`` from the video's start, corrected ``lag`` in seconds, share of ``clipped`` speech, ``snr_db`` of
    speech over noise, share of ``crowded`` frames, ``turn_deg`` away from the camera, ``frozen_s`` without a change,
    pictures a second (``frame_rate``), median distance ``eye_px`` of the outer eye corners, ``jitter`` of the lip
    opening relative to its deviation; ``brightness``, ``glare``, ``contrast`` and ``sharpness`` as
    `corpus_tools.recordings.light.face_light` returns them.
    """

    fit: float
    score: float
    n_filled: int
    cut: float
    lag: float = 0.0
    clipped: float = 0.0
    snr_db: float = np.inf
    crowded: float = 0.0
    turn_deg: float = 0.0
    frozen_s: float = 0.0
    frame_rate: float = np.inf
    eye_px: float = np.inf
    jitter: float = 0.0
    brightness: float = np.inf
    glare: float = 0.0
    contrast: float = np.inf
    sharpness: float = np.inf


@dataclass(frozen=True, slots=True, eq=False)
class Observation:
    """One recording; frame i is the instant ``i / fps`` of the clock of ``phones``, ``quality.cut`` later in ``video``.

    Parameters
    ----------
    landmarks : (T, 478, 3)
        Millimetres, head pose removed; axes as in `tts2face.models.landmarks`.
    head : (T, 6)
        `HEAD_CHANNELS`: angles relative to the camera, position relative to the recording's median.
    intensity : (T,)
        Level of the sound in dB.
    is_recognised
        There is no transcript: the phones were recognised automatically and contain errors.
    mismatches
        What in the words and the sound does not fit, one sentence each.
    """

    name: str
    fps: float
    landmarks: NDArray[np.float32]
    head: NDArray[np.float32]
    phones: PhoneSequence
    words: tuple[WordSpan, ...]
    intensity: NDArray[np.float32]
    quality: Quality
    video: Path
    is_recognised: bool = False
    mismatches: tuple[str, ...] = ()

    @property
    def warnings(self) -> tuple[str, ...]:
        """Messages about measures beyond the limits of warnings."""
        quality = self.quality
        measured = {field.name: getattr(quality, field.name) for field in fields(quality) if field.name != "fit"}
        return (*limit_warnings({**measured, _fit_name(self): quality.fit}), *self.mismatches)


def observe_recording(
    recording: Recording,
    tracker: CachedTracker,
    aligner: CachedAligner,
    timing: Timing,
    *,
    judge: Callable[[Mapping[str, float]], None] = check_limits,
) -> Observation:
    """Read and measure one recording.

    Parameters
    ----------
    judge
        Called with measures by name; by default it refuses those beyond their limits.
    """
    sound = aligner.align(recording.video, pronounce_recording(recording), recording.span)
    measures = sound_measures(sound.sound, sound.phones)
    judge(measures)
    judge({_fit_name(sound): sound.fit})
    tracked = tracker.track(recording.video)
    filled, first, n_filled = _span_landmarks(tracked, recording.span, timing)
    fps = timing.fps or tracked.fps
    first_frame = first / fps
    start = first_frame + timing.lag - (recording.span[0] if recording.span else 0.0)  # in seconds of the sound
    phones, spans = trim_to_picture(sound, start, start + len(filled) / fps)
    posed = remove_pose(filled, fps)
    here = (tracked.times > first_frame - TIME_TOLERANCE_S) & (
        tracked.times < first_frame + len(filled) / fps - TIME_TOLERANCE_S
    )
    measures |= picture_measures(tracked.n_faces[here], tracked.changes[here], tracked.times[here])
    measures["turn_deg"] = head_turn_deg(head_angles(posed.rotations))
    measures |= landmark_measures(filled, posed.landmarks)
    measures |= light_measures(tracker.light(recording.video), first_frame, first_frame + len(filled) / fps)
    judge(measures)
    return Observation(
        name=recording.name,
        fps=fps,
        landmarks=posed.landmarks,
        head=head_motion(posed),
        phones=phones,
        words=spans,
        intensity=intensity(sound.sound, start + np.arange(len(filled)) / fps),
        quality=Quality(
            fit=sound.fit,
            score=float(tracked.tracking.scores[here & ~tracked.tracking.is_missing].min(initial=1.0)),
            n_filled=n_filled,
            cut=first_frame,
            lag=timing.lag,
            **measures,
        ),
        video=recording.video,
        is_recognised=sound.is_recognised,
        mismatches=(*(mismatch.sentence for mismatch in sound.mismatches), *sound_notes([recording.video])),
    )


def _span_landmarks(
    tracked: TrackedVideo, span: tuple[float, float] | None, timing: Timing
) -> tuple[NDArray[np.float32], int, int]:
    """Landmarks of the frames of a span of the sound, the index of the first, and the number of interpolated ones."""
    fps = timing.fps or tracked.fps
    first_frame, end = (0.0, np.inf) if span is None else (span[0] - timing.lag, span[1] - timing.lag)
    near = (tracked.times > first_frame - N_NEIGHBOUR_FRAMES / fps) & (tracked.times < end + N_NEIGHBOUR_FRAMES / fps)
    if near.sum() < MIN_FRAMES:
        where = "" if span is None else f" from {span[0]:.2f} s to {span[1]:.2f} s"
        raise DataError(f"the video has no frames{where}; check its length and the times")
    points, first = resample_to_grid(tracked.tracking.points[near], tracked.times[near], fps)
    instants = (first + np.arange(len(points))) / fps
    inside = (instants > first_frame - TIME_TOLERANCE_S) & (instants < end + TIME_TOLERANCE_S)
    points, first = points[inside], first + int(inside.argmax())
    filled, start, n_filled = trim_and_fill(points, fps)
    return filled, first + start, n_filled


def trim_to_picture(sound: AlignedSpeech, start: float, stop: float) -> tuple[PhoneSequence, tuple[WordSpan, ...]]:
    """Phones and words relative to `start`, without the silence outside [start, stop].

    Raises
    ------
    DataError
        Speech begins before, or ends more than `MAX_OUTSIDE_S` later, or a whole phone lies outside.
    """
    phones = list(sound.phones.phones)
    edges = sound.phones.edges.copy()
    lead = 1 if phones[0] == SILENCE and edges[1] <= start else 0
    tail = len(phones) - (1 if phones[-1] == SILENCE and edges[-2] >= stop else 0)
    phones, edges = phones[lead:tail], edges[lead : tail + 1]
    spoken = [i for i, phone in enumerate(phones) if phone != SILENCE]
    first, last = spoken[0], spoken[-1] + 1
    if 0 < edges[last] - stop <= MAX_OUTSIDE_S and edges[last - 1] < stop:
        edges[last] = stop
    is_outside = edges[first] < start or edges[last] > stop
    edges = np.clip(edges, None, stop)
    if is_outside:
        raise DataError(
            f"there is speech while no face is visible (visible: {start:.2f} s to {stop:.2f} s); cut the video"
        )
    if phones[0] == SILENCE:
        edges[0] = start
    elif edges[0] > start:  # the sound starts after the picture
        phones, edges, lead = [SILENCE, *phones], np.concatenate([[start], edges]), lead - 1
    words = tuple(word.shift(-lead) for word in sound.words)
    return PhoneSequence(phones, edges - start), words


def _fit_name(spoken: AlignedSpeech | Observation) -> str:
    """Name of the limit of the fit."""
    return "recognised" if spoken.is_recognised else "fit"


def head_motion(posed: PoseFreeLandmarks) -> NDArray[np.float32]:
    """(T, 6) head pose as in `Observation`."""
    place = posed.translations - np.median(posed.translations, axis=0)
    return np.column_stack([head_angles(posed.rotations), place]).astype(np.float32)
