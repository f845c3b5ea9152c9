"""Quality measures of recordings and their limits.

Each limit is listed with the median and the worst value of 804 recordings of GRID s1, all of which are suitable.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from corpus_tools.recordings.corpus_video import NOT_COUNTED
from lexicon.errors import DataError
from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.speech.pauses import sound_windows
from tts2face.speech.text_fit import LEAST_CONFIDENCE
from tts2face.types import Waveform

CLIPPED_LEVEL = 0.999  # amplitude from which a sample counts as clipped
MIN_PICTURE_CHANGE = 0.02  # of an 8-bit step: frames that differ by less are equal; camera noise is above
LEVEL_WINDOW_S = 0.02
NOISE_QUANTILE = 0.1  # of the windows without speech; excludes footsteps and breaths


@dataclass(frozen=True, slots=True)
class Limit:
    """A bound of a measure, and the message if it is exceeded."""

    measure: str
    bound: float
    is_minimum: bool
    sentence: str

    def is_broken_by(self, value: float) -> bool:
        """Whether a value exceeds the bound."""
        return value < self.bound if self.is_minimum else value > self.bound


LIMITS = (
    # The median is -7300 for other sentences of GRID's small grammar, -10500 for unrelated text if it aligns at all.
    Limit(
        "confidence",
        LEAST_CONFIDENCE,
        True,
        "the sound does not match the transcript (confidence {value:.0f}); correct the words",
    ),
    Limit(
        "recognised",
        LEAST_CONFIDENCE,
        True,
        "its phones could not be recognised well (confidence {value:.0f}); write the transcript into a .txt beside it",
    ),
    Limit("clipped", 0.005, False, "{value:.1%} of the speech is clipped; record it again with less gain"),
    Limit("snr_db", 10.0, True, "speech is {value:.0f} dB above the noise; record in a quieter room"),
    Limit("crowded", 0.25, False, "{value:.0%} of the frames show more than one face; crop them to one person"),
    Limit("turn_deg", 30.0, False, "the face is turned away by {value:.0f} degrees; film it from the front"),
    Limit("frozen_s", 0.2, False, "the picture is frozen for {value:.2f} s; record it again"),
)


def check_limits(measured: Mapping[str, float]) -> None:
    """Check measures against their limits; measures without a limit are ignored.

    Raises
    ------
    DataError
        A measure exceeds its limit.
    """
    for limit in LIMITS:
        value = measured.get(limit.measure)
        if value is not None and limit.is_broken_by(value):
            raise DataError(limit.sentence.format(value=value))


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
        return {"clipped": clipped, "snr_db": np.inf}
    noise = max(float(np.quantile(quiet, NOISE_QUANTILE)), 1e-10)
    return {"clipped": clipped, "snr_db": float(10 * np.log10(max(float(spoken.mean()), 1e-10) / noise))}


def picture_measures(
    n_faces: NDArray[np.int8], changes: NDArray[np.float32], times: NDArray[np.float64]
) -> dict[str, float]:
    """Share of the counted frames with several faces (``crowded``), and ``frozen_s``: the longest time without change.

    Parameters
    ----------
    n_faces, changes, times : (T,)
        As `corpus_tools.recordings.corpus_video.TrackedVideo` has them.
    """
    counted = n_faces[n_faces != NOT_COUNTED]
    crowded = float((counted > 1).mean()) if len(counted) else 0.0
    still = np.concatenate([[False], changes < MIN_PICTURE_CHANGE, [False]])
    borders = np.flatnonzero(np.diff(still.astype(np.int8))).reshape(-1, 2)
    frozen = max((float(times[last - 1] - times[max(first - 1, 0)]) for first, last in borders), default=0.0)
    return {"crowded": crowded, "frozen_s": frozen}


def head_turn_deg(angles: NDArray[np.floating]) -> float:
    """Median angle in degrees between a face and the camera, from (T, 3) pitch, yaw and roll."""
    angle = np.arccos(np.clip(np.cos(angles[:, 0]) * np.cos(angles[:, 1]), -1.0, 1.0))
    return float(np.degrees(np.median(angle)))
