"""Integrated loudness and true peak of a sound by ITU-R BS.1770-4.

Conventions: mono; loudness in LUFS, where a sine of 997 Hz at full scale measures -3.01 LUFS; peaks in dB of full
scale (dBTP).
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.types import Waveform

BLOCK_S, STEP_S = 0.4, 0.1  # gating blocks overlap by 75 % (BS.1770-4, annex 1)
OFFSET_LUFS = -0.691  # cancels the gain of the K-weighting at 997 Hz
ABSOLUTE_GATE_LUFS = -70.0
RELATIVE_GATE_LU = -10.0
OVERSAMPLING = 4  # annex 2: at least four times, for a peak that is read at most 0.6 dB too low
LOWEST_RATE = 8000  # Hz; the shelving filter needs its frequency well below half of it
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
    from scipy.signal import resample_poly

    if not len(samples):
        return np.zeros(0)
    fine = np.abs(resample_poly(np.asarray(samples, np.float64), OVERSAMPLING, 1))
    peaks: Floats = np.maximum(fine.reshape(len(samples), OVERSAMPLING).max(axis=1), np.abs(samples))
    return peaks


def block_powers(sound: Waveform) -> Floats:
    """(B,) mean square of the K-weighted sound in blocks of 400 ms that begin every 100 ms."""
    from scipy.signal import lfilter

    if sound.rate < LOWEST_RATE:
        raise InputError(
            f"loudness needs a sample rate of {LOWEST_RATE} Hz or more, not {sound.rate}; resample it first"
        )
    block, step = round(BLOCK_S * sound.rate), round(STEP_S * sound.rate)
    weighted = np.zeros(max(len(sound.samples), block))
    weighted[: len(sound.samples)] = sound.samples
    for numerator, denominator in k_weighting(sound.rate):
        weighted = lfilter(numerator, denominator, weighted)
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


def _lufs(power: Floats | np.floating) -> Floats:
    levels: Floats = OFFSET_LUFS + 10.0 * np.log10(np.maximum(power, 10 ** (SILENT_DB / 10)))
    return levels
