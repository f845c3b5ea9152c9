"""Check of one take of gestures before a style is learnt from it: what would be refused, what is weak."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from corpus_tools.decomposition.capture_files import CAPTURE_SUFFIXES, is_livelink
from corpus_tools.recordings.folder import VIDEO_SUFFIXES
from corpus_tools.recordings.limits import (
    REFUSAL,
    UNUSABLE,
    WARNING,
    Finding,
    head_turn_deg,
    landmark_measures,
    light_measures,
    limit_findings,
    picture_measures,
)
from corpus_tools.recordings.video import CachedTracker
from corpus_tools.run_options import RunOptions
from lexicon.errors import DataError, InputError
from tts2face.video.livelink import read_livelink
from tts2face.video.networks import find_bundle
from tts2face.video.pose import head_angles, remove_pose
from tts2face.video.resampling import resample_to_grid, trim_and_fill

LEAST_S = 2.5  # the fields compare 10 preceding frames (0.33 s) and look 6 frames ahead: less leaves no choice
GOOD_S = 20.0  # chosen, not measured: some eight phrases, so that a clip need not repeat one motion
LEAST_SEEN = 0.8  # share of frames with a face below which a warning is given
CAPTURE = "capture"  # code of what is missing in a table, or guessed about it
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
            capture = read_livelink(take)
            seconds, found = capture.weights.duration, [Finding(WARNING, CAPTURE, note) for note in capture.notes]
        elif suffix in VIDEO_SUFFIXES:
            seconds, found = _check_video(
                take, CachedTracker(run_options.folder(), find_bundle(run_options.model)), on_share
            )
        else:
            raise InputError(f"{take.name} is neither a video nor a Live Link Face table; choose another file")
    except DataError as reason:
        return TakeReport(0.0, (Finding(REFUSAL, UNUSABLE, str(reason)),))
    return TakeReport(
        seconds, tuple(sorted([*found, *_length_findings(seconds)], key=lambda finding: finding.severity != REFUSAL))
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
