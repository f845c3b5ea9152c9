"""When lips rest: in silence, and at both ends of a clip."""

from typing import NamedTuple

import numpy as np

from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.numeric.arrays import FloatArray, Mask, smoothstep

RELEASE_FROM_S = 0.08  # distance from speech at which the transition to rest begins
REST_FROM_S = 0.20  # distance from speech at which the face is at rest; recorded lips settle within 0.2 s
# Shorter silence between phones is a pause, in which lips stay half open as the networks have learnt (decision 190).
BREAK_S = 2.0
MIN_EASE_S = 0.06  # transition from and to rest if a clip begins or ends within speech


class _SpeechAround(NamedTuple):
    """Start and end of all speech, and around T times the end of the phone before and the start of the one after.

    Seconds; infinite where there is none. Silence is no phone.
    """

    start: float
    end: float
    end_before: FloatArray
    start_after: FloatArray


def rest_weights(phones: PhoneSequence, times: FloatArray) -> FloatArray:
    """(T,) weights of the rest pose at T times in seconds: 0 in speech, 1 in silence and at both ends."""
    around = _speech_around(phones, times)
    if np.isinf(around.start):
        return np.ones(len(times))
    distance = np.minimum(around.start_after - times, np.maximum(times - around.end_before, 0.0))
    pull = smoothstep(distance, RELEASE_FROM_S, REST_FROM_S)
    last = times[-1]
    onset = np.clip(around.start, MIN_EASE_S, REST_FROM_S)
    offset = np.clip(last - around.end, MIN_EASE_S, REST_FROM_S)
    if onset < REST_FROM_S:
        pull = np.maximum(pull, 1.0 - smoothstep(times, 0.0, onset))
    if offset < REST_FROM_S:
        pull = np.maximum(pull, 1.0 - smoothstep(last - times, 0.0, offset))
    return pull


def is_pause(phones: PhoneSequence, times: FloatArray) -> Mask:
    """(T,) whether T times in seconds lie in silence between phones that is shorter than `BREAK_S`."""
    around = _speech_around(phones, times)
    return np.asarray((around.end_before <= times) & (around.start_after - around.end_before < BREAK_S))


def _speech_around(phones: PhoneSequence, times: FloatArray) -> _SpeechAround:
    """The speech around times (T,), where a phone that has begun counts as the one before."""
    is_sounding = np.array([label != SILENCE for label in phones.phones])
    starts = np.append(phones.edges[:-1][is_sounding], np.inf)
    ends = np.append(-np.inf, phones.edges[1:][is_sounding])
    n_begun = np.searchsorted(starts, times, side="right")
    return _SpeechAround(float(starts[0]), float(ends[-1]), ends[n_begun], starts[n_begun])
