"""Integrated loudness and true peak of a sound by ITU-R BS.1770-4.

Conventions: mono; loudness in LUFS, where a sine of 997 Hz at full scale measures -3.01 LUFS; peaks in dB of full
scale (dBTP).
"""

from collections.abc import Sequence
from functools import cache

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.numeric.arrays import FloatArray
from tts2face.numeric.kernels import kernel
from tts2face.types import Waveform

# BS.1770-4, annex 1: blocks below it do not count
ABSOLUTE_GATE_LUFS = -70.0
BLOCK_S, STEP_S = 0.4, 0.1  # gating blocks overlap by 75 % (BS.1770-4, annex 1)
OFFSET_LUFS = -0.691  # cancels the gain of the K-weighting at 997 Hz
# BS.1770-4, annex 1: of the mean of the blocks above the absolute gate
RELATIVE_GATE_LU = -10.0
OVERSAMPLING = 4  # annex 2: at least four times, for a peak that is read at most 0.6 dB too low
LOWEST_RATE = 8000  # Hz; the shelving filter needs its frequency well below half of it
FILTER_PERIODS, KAISER_BETA = 10, 5.0  # half length of the interpolation filter in samples of the sound; its window
SILENT_DB = -120.0  # digital silence has no logarithm
# The two filters of the K-weighting as analogue prototypes, from which the coefficients for every sample rate follow;
# at 48 kHz they are those of the recommendation's tables (frequency in Hz, quality, gain of the shelf in dB).
SHELF_HZ = 1681.974450955533
SHELF_QUALITY = 0.7071752369554196
SHELF_DB = 3.999843853973347
HIGH_PASS_HZ, HIGH_PASS_QUALITY = 38.13547087602444, 0.5003270373238773
BAND_EXPONENT = 0.4996667741545416  # of the shelf's gain at its middle


def integrated_loudness(sounds: Sequence[Waveform]) -> float:
    """Joint gated loudness of sounds in LUFS; `ABSOLUTE_GATE_LUFS` if no block is louder than that.

    Sounds shorter than a block of 400 ms are padded with silence.

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


def oversampled_peaks(samples: NDArray[np.floating]) -> FloatArray:
    """(n,) largest magnitude of the continuous signal between each of n samples and the next one."""
    peaks = np.abs(np.asarray(samples, np.float64))
    if len(peaks):
        for phase in range(OVERSAMPLING):
            taps = _interpolation_filter()[phase::OVERSAMPLING]
            fine = np.convolve(samples, taps)[FILTER_PERIODS : FILTER_PERIODS + len(peaks)]
            np.maximum(peaks, np.abs(fine), out=peaks)
    return peaks


def block_powers(sound: Waveform) -> FloatArray:
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
    starts = np.arange(0, len(weighted) - block + 1, step)
    powers: FloatArray = np.maximum(sums[starts + block] - sums[starts], 0.0) / block
    return powers


def k_weighting(rate: int) -> tuple[tuple[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]:
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
def filter_biquad(numerator: FloatArray, denominator: FloatArray, samples: FloatArray) -> None:
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
def _interpolation_filter() -> FloatArray:
    """(81,) low-pass filter for fourfold oversampling: a sinc in a Kaiser window over 20 periods of the samples."""
    half = FILTER_PERIODS * OVERSAMPLING
    taps = np.sinc(np.arange(-half, half + 1) / OVERSAMPLING) * np.kaiser(2 * half + 1, KAISER_BETA)
    normalised: FloatArray = taps * (OVERSAMPLING / taps.sum())
    return normalised


def _lufs(power: FloatArray | np.floating) -> FloatArray:
    levels: FloatArray = OFFSET_LUFS + 10.0 * np.log10(np.maximum(power, 10 ** (SILENT_DB / 10)))
    return levels
