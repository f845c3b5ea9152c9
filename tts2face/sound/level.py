"""Loudness normalisation to -16 LUFS (ITU-R BS.1770-4) with a limiter that keeps the true peak below -1 dB."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tts2face.numeric.arrays import FloatArray
from tts2face.numeric.filters import moving_mean, moving_minimum
from tts2face.sound.loudness import ABSOLUTE_GATE_LUFS, integrated_loudness, oversampled_peaks
from tts2face.types import Speech, Waveform, YieldTurn, keep_on

LOUDNESS_LUFS = -16.0  # target for mono speech on phones and computers (AES TD1004: -16 to -20)
CEILING_DB = -1.5  # true peak of a clip, which keeps it below -1 dB after AAC encoding as well
MOST_GAIN_DB = 40.0  # upper limit; sound that needs more is noise
LOOK_AHEAD_S = 0.005
TOLERANCE_LU = 0.05
MOST_STEPS = 12  # iterations; speech of espeak-ng takes 5


def level_speech(
    speeches: Sequence[Speech], gains: Sequence[FloatArray], yield_turn: YieldTurn = keep_on
) -> list[Speech]:
    """Normalise utterances together to `LOUDNESS_LUFS`, apply a relative gain to each, and limit the peaks.

    Parameters
    ----------
    speeches
        N utterances.
    gains
        N arrays of shape (n,), one factor for each sample, or (1,).
    yield_turn
        Called between the steps.
    """
    levelled = normalise_loudness([speech.waveform for speech in speeches])
    yield_turn()
    return [
        replace(speech, waveform=Waveform(limit_peaks(sound.samples * gain, sound.rate), sound.rate))
        for speech, sound, gain in zip(speeches, levelled, gains, strict=True)
    ]


def normalise_loudness(sounds: Sequence[Waveform]) -> list[Waveform]:
    """Multiply sounds by a common gain so that their joint integrated loudness is `LOUDNESS_LUFS`; limit the peaks.

    Digital silence is returned unchanged.

    Notes
    -----
    Since the limiter reduces the loudness, the gain is iterated on the measured loudness of the limited sound.
    """
    loudness = integrated_loudness(sounds)
    # silence: no gain would bring it to the target
    if loudness <= ABSOLUTE_GATE_LUFS:
        return list(sounds)
    peaks = [oversampled_peaks(sound.samples) for sound in sounds]
    gain_db, found = 0.0, list(sounds)
    for _ in range(MOST_STEPS):
        missing, before_db = LOUDNESS_LUFS - loudness, gain_db
        gain_db = min(gain_db + missing, MOST_GAIN_DB)
        if abs(missing) <= TOLERANCE_LU or gain_db == before_db:  # of the same gain a step makes the same sound
            break
        gain = 10 ** (gain_db / 20)
        found = [
            Waveform(gain * sound.samples * _limiting_gain(gain * peak, sound.rate), sound.rate)
            for sound, peak in zip(sounds, peaks, strict=True)
        ]
        loudness = integrated_loudness(found)
    return found


def limit_peaks(samples: NDArray[np.floating], rate: int) -> NDArray[np.float32]:
    """(n,) samples whose true peaks are limited to `CEILING_DB`; unchanged if no peak exceeds it."""
    limited: NDArray[np.float32] = (samples * _limiting_gain(oversampled_peaks(samples), rate)).astype(np.float32)
    return limited


def _limiting_gain(peaks: FloatArray, rate: int) -> FloatArray:
    """(n,) gain in (0, 1] that limits peaks (n,) to the ceiling: a moving minimum, then a moving average.

    Each value averages gains that all suffice at its sample, so that no peak exceeds the ceiling.
    """
    ceiling = 10 ** (CEILING_DB / 20)
    needed = ceiling / np.maximum(peaks, ceiling)
    if not len(needed) or needed.min() == 1.0:
        return needed
    half = max(round(LOOK_AHEAD_S * rate / 2), 1)
    gain = moving_minimum(needed, 4 * half + 3, beyond=1.0)  # one sample wider than the average
    for _ in range(2):  # triangular window of 4 half + 1 samples
        gain = moving_mean(gain, 2 * half + 1)
    return gain
