"""One loudness for every voice: -16 LUFS by ITU-R BS.1770-4, with a limiter that keeps the true peak below -1 dB."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tts2face.speech.bs1770 import ABSOLUTE_GATE_LUFS, integrated_loudness, oversampled_peaks
from tts2face.types import Speech, Waveform

LOUDNESS_LUFS = -16.0  # of mono speech on phones and computers (AES TD1004: -16 to -20)
CEILING_DB = -1.5  # true peak of a clip; -1 dB then holds behind AAC too
MOST_GAIN_DB = 40.0  # no speech lies lower; what does is noise
LOOK_AHEAD_S = 0.005
TOLERANCE_LU = 0.05
MOST_STEPS = 12  # towards the loudness; speech of espeak-ng takes 5

Floats = NDArray[np.float64]


def level_speech(speeches: Sequence[Speech], gains: Sequence[Floats]) -> list[Speech]:
    """Utterances at `LOUDNESS_LUFS` together, then times a relative gain each, (n,) or (1,), peaks limited."""
    levelled = normalise_loudness([speech.waveform for speech in speeches])
    return [
        replace(speech, waveform=Waveform(limit_peaks(sound.samples * gain, sound.rate), sound.rate))
        for speech, sound, gain in zip(speeches, levelled, gains, strict=True)
    ]


def normalise_loudness(sounds: Sequence[Waveform]) -> list[Waveform]:
    """Sounds times one gain, with which their integrated loudness together is `LOUDNESS_LUFS`, peaks limited.

    Digital silence stays as it is.

    Notes
    -----
    A limiter takes loudness away, so the gain is found by repeated measurement of what comes out of it.
    """
    loudness = integrated_loudness(sounds)
    if loudness <= ABSOLUTE_GATE_LUFS:
        return list(sounds)
    peaks = [oversampled_peaks(sound.samples) for sound in sounds]
    gain_db, found = 0.0, list(sounds)
    for _ in range(MOST_STEPS):
        missing = LOUDNESS_LUFS - loudness
        if abs(missing) <= TOLERANCE_LU:
            break
        gain_db = min(gain_db + missing, MOST_GAIN_DB)
        gain = 10 ** (gain_db / 20)
        found = [
            Waveform(gain * sound.samples * _limiting_gain(gain * peak, sound.rate), sound.rate)
            for sound, peak in zip(sounds, peaks, strict=True)
        ]
        loudness = integrated_loudness(found)
    return found


def limit_peaks(samples: NDArray[np.floating], rate: int) -> NDArray[np.float32]:
    """(n,) samples whose true peaks are turned down to `CEILING_DB`; the same samples where none lies above it."""
    limited: NDArray[np.float32] = (samples * _limiting_gain(oversampled_peaks(samples), rate)).astype(np.float32)
    return limited


def _limiting_gain(peaks: Floats, rate: int) -> Floats:
    """(n,) gain in (0, 1] that holds peaks at the ceiling: the least one needed nearby, smoothed over as long a time.

    Each value is a mean of gains that all suffice at its own instant, so that no peak passes.
    """
    from scipy.ndimage import minimum_filter1d, uniform_filter1d

    ceiling = 10 ** (CEILING_DB / 20)
    needed = ceiling / np.maximum(peaks, ceiling)
    if not len(needed) or needed.min() == 1.0:
        return needed
    half = max(round(LOOK_AHEAD_S * rate / 2), 1)
    gain = minimum_filter1d(needed, 4 * half + 3, mode="constant", cval=1.0)  # a sample wider than the mean at each end
    for _ in range(2):  # a triangle of 4 half + 1
        gain = uniform_filter1d(gain, 2 * half + 1, mode="nearest")
    smooth: Floats = gain
    return smooth
