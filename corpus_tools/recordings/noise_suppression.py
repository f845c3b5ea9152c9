"""Suppression of stationary noise before phones are aligned or recognised; the recordings themselves do not change.

With noise 10 dB below the speech, forced alignment displaces words by 97 ms on average; after suppression by 32 ms
(docs/decisions/129-recording-limits.md).
"""

import numpy as np
from numpy.typing import NDArray

from tts2face.speech.pauses import sound_windows
from tts2face.types import Waveform

MIN_RANGE_DB = 20.0  # level range below which noise is suppressed; recordings of GRID s1 have 22.9 or more
LEVEL_WINDOW_S = 0.02
RANGE_QUANTILES = (0.1, 0.95)  # of the windows' levels: noise, loud speech
WINDOW, STEP = 512, 128  # samples of the short-time spectrum at 16 kHz: 32 and 8 ms
QUIET_SHARE = 0.2  # of the windows, the quietest, whose mean spectrum is that of the noise
QUIET_SMOOTHING = 5  # windows over which levels are averaged before the quietest are chosen
PRIOR_WEIGHT = 0.98  # of the previous window in the estimated signal-to-noise ratio (Ephraim and Malah 1984)
MIN_GAIN = 0.03  # 0.1 and 0.25 leave 40 and 52 ms of error
MIN_POWER = 1e-12

Floats = NDArray[np.float64]


def level_range_db(sound: Waveform) -> float:
    """Level of loud speech over that of the quietest parts in dB; infinite if these are silent or there is no sound."""
    windows = sound_windows(sound, LEVEL_WINDOW_S)
    if not len(windows):
        return float("inf")
    low, high = np.quantile(np.square(windows, dtype=np.float64).mean(axis=1), RANGE_QUANTILES)
    return float(10.0 * np.log10(high / low)) if low > 0 else float("inf")


def suppress_noise(sound: Waveform) -> Waveform:
    """The sound with stationary noise suppressed; unchanged if its level range is at least `MIN_RANGE_DB`.

    Notes
    -----
    Wiener gains per frequency with the decision-directed estimate of the signal-to-noise ratio. Source: Ephraim and
    Malah 1984, "Speech enhancement using a minimum mean-square error short-time spectral amplitude estimator", eq. 51.
    """
    if len(sound.samples) < WINDOW or level_range_db(sound) >= MIN_RANGE_DB:
        return sound
    from scipy.signal import istft, stft

    samples, overlap = sound.samples.astype(np.float64), WINDOW - STEP
    spectrum = stft(samples, fs=sound.rate, nperseg=WINDOW, noverlap=overlap)[2]
    gains = wiener_gains(np.square(np.abs(spectrum)))
    cleaned = np.real(istft(spectrum * gains, fs=sound.rate, nperseg=WINDOW, noverlap=overlap)[1])
    return Waveform(np.clip(cleaned[: len(samples)], -1.0, 1.0).astype(np.float32), sound.rate)


def wiener_gains(power: Floats) -> Floats:
    """Gains (F, T) for the power (F, T) of a short-time spectrum whose quietest windows are noise."""
    from scipy.ndimage import uniform_filter1d

    level = uniform_filter1d(10.0 * np.log10(power.sum(axis=0) + MIN_POWER), QUIET_SMOOTHING)
    noise = np.maximum(power[:, level <= np.quantile(level, QUIET_SHARE)].mean(axis=1), MIN_POWER)
    ratio = power / noise[:, None]
    gains = np.zeros_like(power)
    before = np.zeros(len(power))
    for at in range(power.shape[1]):
        expected = PRIOR_WEIGHT * before + (1.0 - PRIOR_WEIGHT) * np.maximum(ratio[:, at] - 1.0, 0.0)
        gains[:, at] = np.maximum(expected / (1.0 + expected), MIN_GAIN)
        before = np.square(gains[:, at]) * ratio[:, at]
    return gains
