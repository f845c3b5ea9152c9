"""Smooth transitions of spans and key frames."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tts2face.numeric import smoothstep

FloatArray = NDArray[np.float64]
Keys = tuple[tuple[float, float], ...]  # seconds, value


def span_weights(times: ArrayLike, start: float, end: float, ease_s: float) -> FloatArray:
    """(T,) weights of a span at T times in seconds: 0 outside, 1 inside, 0.5 at its edges.

    The edges are smoothed by a raised cosine of width `ease_s`, so that the weights of adjacent spans add up to 1. A
    span that starts at or before 0 s has no rising edge, an infinite one no falling edge.
    """
    seconds = np.asarray(times, np.float64)
    begun = np.ones(seconds.shape) if start <= 0.0 else _raised_cosine_integral((seconds - start) / ease_s)
    ended = np.zeros(seconds.shape) if np.isinf(end) else _raised_cosine_integral((seconds - end) / ease_s)
    return begun - ended


def _raised_cosine_integral(share: FloatArray) -> FloatArray:
    """Integral of a raised cosine: 0 at -1/2, 1 at 1/2."""
    at = np.clip(2 * share, -1.0, 1.0)
    return 0.5 * (1 + at + np.sin(np.pi * at) / np.pi)


def interpolate_keys(times: ArrayLike, keys: Keys) -> FloatArray:
    """(T,) values at T times of a curve through (time, value) keys with zero slope at each; constant outside."""
    seconds = np.asarray(times, np.float64)
    at, values = np.array(keys).T
    if len(keys) == 1:
        return np.full(seconds.shape, values[0])
    behind = np.clip(np.searchsorted(at, seconds, side="right"), 1, len(at) - 1)
    before = behind - 1
    share = smoothstep((seconds - at[before]) / (at[behind] - at[before]))
    curve: FloatArray = values[before] + (values[behind] - values[before]) * share
    return curve
