"""Loudness normalisation to -16 LUFS (ITU-R BS.1770-4) with a limiter that keeps the true peak below -1 dB.

Integrated loudness and true peak of a sound by ITU-R BS.1770-4.

Conventions: mono; loudness in LUFS, where a sine of 997 Hz at full scale measures -3.01 LUFS; peaks in dB of full
scale (dBTP).
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.numeric.filters import moving_mean, moving_minimum
from tts2face.numeric.kernels import kernel
from tts2face.types import Speech, Waveform, YieldTurn, keep_on

BLOCK_S, STEP_S = 0.4, 0.1  # gating blocks overlap by 75 % (BS.1770-4, annex 1)
OFFSET_LUFS = -0.691  # cancels the gain of the K-weighting at 997 Hz
ABSOLUTE_GATE_LUFS = -70.0
RELATIVE_GATE_LU = -10.0
OVERSAMPLING = 4  # annex 2: at least four times, for a peak that is read at most 0.6 dB too low
LOWEST_RATE = 8000  # Hz; the shelving filter needs its frequency well below half of it
FILTER_PERIODS, KAISER_BETA = 10, 5.0  # half length of the interpolation filter in samples of the sound; its window
SILENT_DB = -120.0  # digital silence has no logarithm
# The two filters of the K-weighting as analogue prototypes, from which the coefficients for every sample rate follow;
# at 48 kHz they are those of the recommendation's tables (frequency in Hz, quality, gain of the shelf in dB).
SHELF_HZ, SHELF_QUALITY, SHELF_DB = 1681.974450955533, 0.7071752369554196, 3.999843853973347
HIGH_PASS_HZ, HIGH_PASS_QUALITY = 38.13547087602444, 0.5003270373238773
BAND_EXPONENT = 0.4996667741545416  # of the shelf's gain at its middle

Floats = NDArray[np.float64]


def integrated_loudness(sounds: Sequence[Waveform]) -> float:
    """Joint gated loudness of sounds in LUFS; `ABSOLUTE_GATE_LUFS` if no block is louder than that.

    Sounds shorter than a block of 400 ms are padded with silence.

    Raises
    ------
    InputError
        A sample rate is below `LOWEST_RATE`.

    Notes
    -----
    Blocks do not reach from one sound into the next. Source: ITU-R BS.1770-4, annex 1.
    """
    powers = np.concatenate([np.zeros(0), *(block_powers(sound) for sound in sounds)])
    audible = powers[_lufs(powers) > ABSOLUTE_GATE_LUFS]
    if not len(audible):
        return ABSOLUTE_GATE_LUFS
    gate = float(_lufs(audible.mean())) + RELATIVE_GATE_LU
    return float(_lufs(audible[_lufs(audible) > gate].mean()))


def oversampled_peaks(samples: NDArray[np.floating]) -> Floats:
    """(n,) largest magnitude of the continuous signal between each of n samples and the next one."""
    peaks = np.abs(np.asarray(samples, np.float64))
    if len(peaks):
        for phase in range(OVERSAMPLING):
            taps = _interpolation_filter()[phase::OVERSAMPLING]
            fine = np.convolve(samples, taps)[FILTER_PERIODS : FILTER_PERIODS + len(peaks)]
            np.maximum(peaks, np.abs(fine), out=peaks)
    return peaks


def block_powers(sound: Waveform) -> Floats:
    """(B,) mean square of the K-weighted sound in blocks of 400 ms that begin every 100 ms."""
    if sound.rate < LOWEST_RATE:
        raise InputError(
            f"loudness needs a sample rate of {LOWEST_RATE} Hz or more, not {sound.rate}; resample it first"
        )
    block, step = round(BLOCK_S * sound.rate), round(STEP_S * sound.rate)
    weighted = np.zeros(max(len(sound.samples), block))
    weighted[: len(sound.samples)] = sound.samples
    for numerator, denominator in k_weighting(sound.rate):
        filter_biquad(numerator, denominator, weighted)
    sums = np.concatenate([[0.0], np.cumsum(np.square(weighted))])
    begins = np.arange(0, len(weighted) - block + 1, step)
    powers: Floats = np.maximum(sums[begins + block] - sums[begins], 0.0) / block
    return powers


def k_weighting(rate: int) -> tuple[tuple[Floats, Floats], tuple[Floats, Floats]]:
    """Numerator and denominator of the shelving filter and of the high-pass filter at a sample rate in Hz."""
    k = np.tan(np.pi * SHELF_HZ / rate)
    top = 10 ** (SHELF_DB / 20)
    middle = top**BAND_EXPONENT
    scale = 1.0 + k / SHELF_QUALITY + k * k
    shelf = (
        np.array(
            [top + middle * k / SHELF_QUALITY + k * k, 2 * (k * k - top), top - middle * k / SHELF_QUALITY + k * k]
        )
        / scale,
        np.array([1.0, 2 * (k * k - 1) / scale, (1.0 - k / SHELF_QUALITY + k * k) / scale]),
    )
    k = np.tan(np.pi * HIGH_PASS_HZ / rate)
    scale = 1.0 + k / HIGH_PASS_QUALITY + k * k
    high_pass = (
        np.array([1.0, -2.0, 1.0]),
        np.array([1.0, 2 * (k * k - 1) / scale, (1.0 - k / HIGH_PASS_QUALITY + k * k) / scale]),
    )
    return shelf, high_pass


@kernel
def filter_biquad(numerator: Floats, denominator: Floats, samples: Floats) -> None:
    """Replace samples (n,) by those filtered with a second-order section from rest (transposed direct form II).

    numerator, denominator: (3,) coefficients; the first one of the denominator is 1.
    """
    first = second = 0.0
    for n, sample in enumerate(samples):
        output = first + numerator[0] * sample
        first = second + numerator[1] * sample - denominator[1] * output
        second = numerator[2] * sample - denominator[2] * output
        samples[n] = output


@cache
def _interpolation_filter() -> Floats:
    """(81,) low-pass filter for fourfold oversampling: a sinc in a Kaiser window over 20 periods of the samples."""
    half = FILTER_PERIODS * OVERSAMPLING
    taps = np.sinc(np.arange(-half, half + 1) / OVERSAMPLING) * np.kaiser(2 * half + 1, KAISER_BETA)
    normalised: Floats = taps * (OVERSAMPLING / taps.sum())
    return normalised


def _lufs(power: Floats | np.floating) -> Floats:
    levels: Floats = OFFSET_LUFS + 10.0 * np.log10(np.maximum(power, 10 ** (SILENT_DB / 10)))
    return levels


LOUDNESS_LUFS = -16.0  # target for mono speech on phones and computers (AES TD1004: -16 to -20)
CEILING_DB = -1.5  # true peak of a clip, which keeps it below -1 dB after AAC encoding as well
MOST_GAIN_DB = 40.0  # upper limit; sound that needs more is noise
LOOK_AHEAD_S = 0.005
TOLERANCE_LU = 0.05
MOST_STEPS = 12  # iterations; speech of espeak-ng takes 5


def level_speech(speeches: Sequence[Speech], gains: Sequence[Floats], yield_turn: YieldTurn = keep_on) -> list[Speech]:
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


def _limiting_gain(peaks: Floats, rate: int) -> Floats:
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
