"""Pitch of a voice for gestures, without Praat, whose library takes 62 MB and ten times as long (decision 073)."""

import numpy as np
from numpy.typing import NDArray

from tts2face.numeric.arrays import FloatArray
from tts2face.types import Waveform

RANGE_HZ = (70.0, 450.0)
WINDOW_S = 0.045  # three periods of the lowest pitch
WORKING_HZ = 6_000  # least rate of the sound in which periods are sought
LEAST_STRENGTH = 0.45  # autocorrelation of voiced frames (Boersma 1993), and level below the loudest frame in dB
QUIET_DB = 30.0
OCTAVE_COST = 0.06  # of a lag twice as long, as periods repeat
SEMITONES_PER_OCTAVE, LARGEST = 12.0, 12.0


def semitones(sound: Waveform, times: NDArray[np.float64]) -> FloatArray:
    """(T,) pitch at times (T,) in semitones from the median, within an octave of it; NaN on unvoiced frames.

    Notes
    -----
    The highest peak of the autocorrelation divided by that of the window (Boersma 1993), without a path between frames.
    """
    factor = max(1, sound.rate // WORKING_HZ)
    n_used = len(sound.samples) // factor * factor
    samples = sound.samples[:n_used].reshape(-1, factor).mean(axis=1, dtype=np.float64)
    rate = sound.rate / factor
    size = round(WINDOW_S * rate)
    unvoiced = np.full(len(times), np.nan)
    if len(samples) <= size or not len(times):
        return unvoiced
    starts = np.clip(np.round(times * rate).astype(np.int64) - size // 2, 0, len(samples) - size)
    frames = samples[starts[:, None] + np.arange(size)]
    frames -= frames.mean(axis=1, keepdims=True)
    power = np.square(frames).mean(axis=1)
    lags = np.arange(int(rate / RANGE_HZ[1]), int(rate / RANGE_HZ[0]) + 2)
    strength = _autocorrelation(frames)[:, lags[0] - 1 : lags[-1] + 2]
    costs = strength[:, 1:-1] - OCTAVE_COST * np.log2(lags * RANGE_HZ[1] / rate)
    best = costs.argmax(axis=1)
    rows = np.arange(len(times))
    before, at, behind = (strength[rows, best + shift] for shift in range(3))
    bend = before - 2 * at + behind
    shift = np.where(bend < 0, 0.5 * (before - behind) / np.minimum(bend, -1e-9), 0.0)
    loud = power > power.max() * 10 ** (-QUIET_DB / 10)
    voiced = (at > LEAST_STRENGTH) & loud & (best > 0) & (times >= 0.0) & (times < sound.duration)
    if not voiced.any():
        return unvoiced
    pitch = SEMITONES_PER_OCTAVE * np.log2(rate / (lags[best] + np.clip(shift, -0.5, 0.5)))
    return np.where(voiced, np.clip(pitch - np.median(pitch[voiced]), -LARGEST, LARGEST), np.nan)


def _autocorrelation(frames: FloatArray) -> FloatArray:
    """(T, n) autocorrelation of frames (T, n) in a Hann window, divided by that of the window; 1 at lag 0."""
    n = frames.shape[1]
    window = np.hanning(n + 2)[1:-1]
    size = 1 << (2 * n - 1).bit_length()

    def correlate(values: FloatArray) -> FloatArray:
        spectrum = np.fft.rfft(values, size)
        return np.fft.irfft(np.square(spectrum.real) + np.square(spectrum.imag), size)[..., :n]

    found, of_window = correlate(frames * window), correlate(window)
    return np.asarray(
        found / np.maximum(found[:, :1], 1e-12) * of_window[0] / np.maximum(of_window, 1e-3 * of_window[0])
    )
