"""Measures of spoken sound that benchmarks of voices share: phones that are heard, F0, silence, rises."""

import functools
from collections.abc import Sequence

import numpy as np
import parselmouth
from numpy.typing import NDArray

from tts2face.sound.recogniser import PhoneRecogniser
from tts2face.types import Speech, Waveform

# Phones that the recogniser takes for each other, and vowels that are reduced.
ALIKE = {
    "ʌ": "ə", "ɐ": "ə", "ɪ": "ə", "ʊ": "ə", "ɛ": "ə", "ɒ": "ɑ", "ɔ": "ɑ", "ɾ": "t", "ʉ": "u", "əʊ": "oʊ", "ɜ": "ə",
}  # fmt: skip
RHOTIC = {"ɚ": ("ə", "ɹ"), "ɝ": ("ə", "ɹ")}
HEARD_LEVEL = 0.5  # of full scale: resampling of louder sound exceeds it
QUIET_DB, WINDOW_S = -40.0, 0.005
PITCH_LIMITS_HZ, PITCH_STEP_S = (50.0, 600.0), 0.005
RISE_S, RISE_ST = 0.2, 3.0


@functools.cache
def recogniser() -> PhoneRecogniser:
    """The product's recogniser, loaded once."""
    return PhoneRecogniser()


def phone_errors(said: Sequence[str], sound: Waveform) -> tuple[int, int]:
    """Substituted, lost and added phones in what is heard, and the number of phones that are said."""
    scaled = Waveform(sound.samples * np.float32(HEARD_LEVEL / np.abs(sound.samples).max()), sound.rate)
    heard = _folded([phone for word in recogniser().hear(scaled).words() for phone in word])
    expected = _folded(said)
    row = np.arange(len(heard) + 1)
    for phone in expected:
        before, row = row, np.empty_like(row)
        row[0] = before[0] + 1
        for at, other in enumerate(heard, start=1):
            row[at] = min(before[at] + 1, row[at - 1] + 1, before[at - 1] + (phone != other))
    return int(row[-1]), len(expected)


def _folded(phones: Sequence[str]) -> list[str]:
    return [ALIKE.get(part, part) for phone in phones for part in RHOTIC.get(phone, (phone,))]


def pitch_track(sound: Waveform) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Seconds and F0 in semitones above 1 Hz (T,) of frames with voice, by Praat."""
    low, high = PITCH_LIMITS_HZ
    found = parselmouth.Sound(sound.samples.astype(float), sound.rate).to_pitch_ac(
        time_step=PITCH_STEP_S, pitch_floor=low, pitch_ceiling=high
    )
    hertz = found.selected_array["frequency"]
    return found.xs()[hertz > 0], 12.0 * np.log2(hertz[hertz > 0])


def rise_at(speech: Speech, word: int = -1) -> float:
    """Semitones by which F0 rises over the last `RISE_S` with voice of a word; NaN without voice."""
    times, tones = pitch_track(speech.waveform)
    span = speech.words[word]
    start, end = speech.phones.edges[[span.first, span.last]]
    inside = np.flatnonzero((times > start - 0.05) & (times < end))
    if len(inside) < 6:
        return float("nan")
    inside = inside[times[inside] > times[inside[-1]] - RISE_S]
    third = max(len(inside) // 3, 1)
    return float(np.median(tones[inside[-third:]]) - np.median(tones[inside[:third]]))


def loud_windows(sound: Waveform) -> NDArray[np.int64]:
    """Windows of `WINDOW_S` that are no more than `QUIET_DB` below the loudest one."""
    window = round(WINDOW_S * sound.rate)
    powers = np.square(sound.samples[: len(sound.samples) // window * window].reshape(-1, window)).mean(axis=1)
    return np.flatnonzero(powers > powers.max() * 10 ** (QUIET_DB / 10))


def silence_at_ends(sound: Waveform) -> tuple[float, float]:
    """Seconds."""
    loud = loud_windows(sound)
    return float(loud[0] * WINDOW_S), float(sound.duration - (loud[-1] + 1) * WINDOW_S)


def longest_gap(sound: Waveform) -> float:
    """Seconds of the longest silence between sounds."""
    return float((np.diff(loud_windows(sound)).max() - 1) * WINDOW_S)


def spoken_seconds(sound: Waveform) -> float:
    """From the first to the last sound."""
    loud = loud_windows(sound)
    return float((loud[-1] - loud[0] + 1) * WINDOW_S)
