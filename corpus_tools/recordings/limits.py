"""Quality measures of recordings and their limits: a warning beyond the first, a refusal beyond the second.

`tests/bench/bench_recording_limits.py` measures their distributions in good, damaged and desynchronised recordings;
docs/recordings.md has the table, docs/decisions/129-recording-limits.md the reasons.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from corpus_tools.recordings.light import MEASURES
from corpus_tools.recordings.sound import LEVEL_WINDOW_S
from corpus_tools.recordings.video import NOT_COUNTED
from lexicon.errors import DataError
from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.models.landmarks import EYE_OUTER_LEFT, EYE_OUTER_RIGHT, lip_opening
from tts2face.numeric.arrays import true_runs
from tts2face.sound.alignment import LEAST_FIT
from tts2face.sound.pauses import SILENCE_DB, sound_windows
from tts2face.types import Waveform

WARNING, REFUSAL = "warning", "refusal"  # severities
UNUSABLE, OUT_OF_SYNC = "unusable", "out_of_sync"  # codes of findings without a measure
CLIPPED_LEVEL = 0.999  # amplitude from which a sample counts as clipped
MIN_PICTURE_CHANGE = 0.02  # of an 8-bit step: frames that differ by less are equal; camera noise is above
NOISE_QUANTILE = 0.1  # of the windows without speech; excludes footsteps and breaths
NOISY_DB = 20.0  # ratio of speech to noise below which lips are learnt worse
MEDIAN_TO_DEVIATION = 1.4826  # of a normal distribution
SECOND_DIFFERENCE_GAIN = np.sqrt(6.0)  # of white noise: 1 + 4 + 1 variances


@dataclass(frozen=True, slots=True)
class Limit:
    """Bounds of a measure for a warning and for a refusal, and the message, with ``{value}`` and ``{bound}``."""

    measure: str
    warning: float
    refusal: float
    is_minimum: bool
    sentence: str

    def message(self, value: float, bound: float) -> str | None:
        """The message if a value exceeds a bound, otherwise None."""
        is_broken = value < bound if self.is_minimum else value > bound
        return self.sentence.format(value=value, bound=bound) if is_broken else None


WORDS = "the sound does not match the transcript ({value:.0%} of it is heard, limit {bound:.0%}); correct the words"
PHONES = (
    "its phones could not be recognised well ({value:.0%} of them are sure, limit {bound:.0%}); "
    "write the transcript into a .txt beside it"
)
LIPS = (
    "lip motion does not match the sound (correlation {value:.2f}, limit {bound:.2f}); "
    "give the original sound or record it again"
)
LIMITS = (
    Limit("fit", 0.75, LEAST_FIT, True, WORDS),
    Limit("recognised", 0.75, LEAST_FIT, True, PHONES),
    Limit(
        "clipped",
        0.005,
        0.3,
        False,
        "{value:.1%} of the speech is clipped, limit {bound:.1%}; record it again with less gain",
    ),
    Limit(
        "snr_db",
        NOISY_DB,
        6.0,
        True,
        "speech is {value:.0f} dB above the noise, limit {bound:.0f} dB; record in a quieter room",
    ),
    Limit(
        "crowded",
        0.02,
        0.25,
        False,
        "{value:.0%} of the frames show more than one face, limit {bound:.0%}; crop them to one person",
    ),
    Limit(
        "turn_deg",
        20.0,
        30.0,
        False,
        "the face is turned away by {value:.0f} degrees, limit {bound:.0f} degrees; film it from the front",
    ),
    Limit(
        "brightness",
        50.0,
        15.0,
        True,
        "the face is dark (brightness {value:.0f} of 255, limit {bound:.0f}); put a lamp or a window in front of you",
    ),
    Limit(
        "glare",
        0.1,
        0.8,
        False,
        "{value:.0%} of the face is overexposed, limit {bound:.0%}; lower the exposure or move away from the lamp",
    ),
    Limit(
        "contrast",
        20.0,
        5.0,
        True,
        "the face has little contrast ({value:.0f} of 255 levels, limit {bound:.0f}); move the light to one side and "
        "away from behind you",
    ),
    Limit(
        "sharpness",
        0.03,
        0.016,
        True,
        "the face is blurred (sharpness {value:.3f}, limit {bound:.3f}); wipe the lens and focus on the face",
    ),
    # A closure of the lips of 0.05 s is in one frame at 20 frames a second, and in every second one at 10.
    Limit(
        "frame_rate",
        20.0,
        10.0,
        True,
        "the camera gives {value:.0f} pictures a second, limit {bound:.0f}; add light and close other programs",
    ),
    Limit("frozen_s", 0.1, 0.3, False, "the picture is frozen for {value:.2f} s, limit {bound:.2f} s; record it again"),
    Limit(
        "eye_px",
        30.0,
        12.0,
        True,
        "the outer eye corners are {value:.0f} px apart, limit {bound:.0f} px; film the face larger",
    ),
    Limit(
        "jitter",
        0.2,
        0.5,
        False,
        "tracked lips jitter by {value:.2f} of their motion, limit {bound:.2f}; record with more light",
    ),
    Limit("sync", 0.35, 0.25, True, LIPS),
    Limit("sync_of_short", 0.3, 0.15, True, LIPS),
)


@dataclass(frozen=True, slots=True)
class Finding:
    """A weakness of a recording.

    ``severity`` is ``warning`` or ``refusal``; ``code`` names the measure, or is `UNUSABLE` or `OUT_OF_SYNC`;
    ``message`` says what to do; ``value`` of the measure and the ``limit`` that it exceeds, None without a measure.
    """

    severity: str
    code: str
    message: str
    value: float | None = None
    limit: float | None = None


def limit_findings(measured: Mapping[str, float]) -> tuple[Finding, ...]:
    """A finding for each measure beyond a limit; measures without a limit are ignored."""
    found = []
    for limit in LIMITS:
        value = measured.get(limit.measure)
        if value is None:
            continue
        for severity, bound in ((REFUSAL, limit.refusal), (WARNING, limit.warning)):
            if message := limit.message(value, bound):
                found.append(Finding(severity, limit.measure, message, value, bound))
                break
    return tuple(found)


def check_limits(measured: Mapping[str, float]) -> None:
    """Check measures against the limits of refusal; measures without a limit are ignored.

    Raises
    ------
    DataError
        A measure exceeds its limit.
    """
    for finding in limit_findings(measured):
        if finding.severity == REFUSAL:
            raise DataError(finding.message)


def limit_warnings(measured: Mapping[str, float]) -> tuple[str, ...]:
    """Messages about the measures that exceed the limits of warnings."""
    found = (limit.message(measured[limit.measure], limit.warning) for limit in LIMITS if limit.measure in measured)
    return tuple(message for message in found if message)


def sound_measures(sound: Waveform, phones: PhoneSequence) -> dict[str, float]:
    """Share of the speech that is ``clipped``, and ``snr_db``: level of the speech over that of the pauses in dB.

    Without pauses the noise cannot be estimated and the ratio is infinite.
    """
    blocks = sound_windows(sound, LEVEL_WINDOW_S)
    n_windows = len(blocks)
    middles = (np.arange(n_windows) + 0.5) * LEVEL_WINDOW_S
    at = np.clip(np.searchsorted(phones.edges, middles, side="right") - 1, 0, len(phones) - 1)
    is_speech = np.array([phone != SILENCE for phone in phones.phones])[at] if n_windows else np.zeros(0, bool)
    power = np.square(blocks, dtype=np.float64).mean(axis=1)
    spoken, quiet = power[is_speech], power[~is_speech]
    clipped = float((np.abs(blocks[is_speech]) >= CLIPPED_LEVEL).mean()) if is_speech.any() else 0.0
    if not len(quiet) or not len(spoken):
        # without a pause there is no noise to measure
        return {"clipped": clipped, "snr_db": np.inf}
    room = quiet[quiet > spoken.mean() * 10 ** (-SILENCE_DB / 10)]  # where a stem is muted, the room is not heard
    noise = max(float(np.quantile(room if len(room) else quiet, NOISE_QUANTILE)), 1e-10)
    return {"clipped": clipped, "snr_db": float(10 * np.log10(max(float(spoken.mean()), 1e-10) / noise))}


def picture_measures(
    n_faces: NDArray[np.int8], changes: NDArray[np.float32], times: NDArray[np.float64]
) -> dict[str, float]:
    """Share of the counted frames with several faces (``crowded``), ``frozen_s``, ``frame_rate``.

    ``frozen_s`` is the longest time without a change, ``frame_rate`` the number of pictures a second.

    Parameters
    ----------
    n_faces, changes, times : (T,)
        As `corpus_tools.recordings.video.TrackedVideo` has them.
    """
    counted = n_faces[n_faces != NOT_COUNTED]
    crowded = float((counted > 1).mean()) if len(counted) else 0.0
    still = true_runs(changes < MIN_PICTURE_CHANGE)
    frozen = max((float(times[last - 1] - times[max(first - 1, 0)]) for first, last in still), default=0.0)
    seconds = float(times[-1] - times[0]) if len(times) else 0.0
    rate = (len(times) - 1) / seconds if seconds > 0 else np.inf
    return {"crowded": crowded, "frozen_s": frozen, "frame_rate": rate}


def light_measures(light: NDArray[np.floating], start: float, end: float) -> dict[str, float]:
    """Medians of `corpus_tools.recordings.light.MEASURES` between two times in seconds; nothing without a face.

    Parameters
    ----------
    light : (N, 5)
        As `corpus_tools.recordings.light.measure_light` returns it.
    """
    here = light[(light[:, 0] >= start) & (light[:, 0] < end)]
    if not len(here):  # shorter than the interval of the measures
        here = light[[np.abs(light[:, 0] - start).argmin()]] if len(light) else light
    return dict(zip(MEASURES, np.median(here[:, 1:], axis=0).tolist(), strict=True)) if len(here) else {}


def head_turn_deg(angles: NDArray[np.floating]) -> float:
    """Median angle in degrees between a face and the camera, from (T, 3) pitch, yaw and roll."""
    angle = np.arccos(np.clip(np.cos(angles[:, 0]) * np.cos(angles[:, 1]), -1.0, 1.0))
    return float(np.degrees(np.median(angle)))


def landmark_measures(points: NDArray[np.floating], landmarks: NDArray[np.floating]) -> dict[str, float]:
    """Median distance ``eye_px`` of the outer eye corners, and ``jitter``: noise of the lip opening over its deviation.

    Parameters
    ----------
    points, landmarks : (T, 478, 3)
        In pixels, and pose-free in mm. The noise is that of white noise with the median second difference.
    """
    apart = np.linalg.norm(points[:, EYE_OUTER_LEFT, :2] - points[:, EYE_OUTER_RIGHT, :2], axis=1)
    opening = lip_opening(landmarks).astype(np.float64)
    bends = np.diff(opening, 2)
    spread = float(opening.std())
    noise = MEDIAN_TO_DEVIATION * float(np.median(np.abs(bends))) / SECOND_DIFFERENCE_GAIN if len(bends) else 0.0
    return {"eye_px": float(np.median(apart)), "jitter": noise / spread if spread > 0 else 0.0}
