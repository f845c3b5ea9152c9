"""Smooth beginnings and ends: how much of a span is on at each instant."""

from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]


def span_weights(times: ArrayLike, start: float, end: float, ease_s: float) -> FloatArray:
    """Share (T,) of a span that is on at each of T times: 0 outside, 1 inside, half at its edges.

    The span's step smoothed by a raised cosine `ease_s` wide, so that the shares of spans that meet add up to 1. A span
    from 0 s or before has been on all along, one until infinity stays.
    """
    seconds = np.asarray(times, np.float64)
    begun = np.ones(seconds.shape) if start <= 0.0 else _raised_cosine_integral((seconds - start) / ease_s)
    ended = np.zeros(seconds.shape) if np.isinf(end) else _raised_cosine_integral((seconds - end) / ease_s)
    return begun - ended


def _raised_cosine_integral(share: FloatArray) -> FloatArray:
    """From 0 at -1/2 to 1 at 1/2: the integral of a raised cosine."""
    at = np.clip(2 * share, -1.0, 1.0)
    return 0.5 * (1 + at + np.sin(np.pi * at) / np.pi)


def interpolate_keys(times: ArrayLike, keys: tuple[tuple[float, float], ...]) -> FloatArray:
    """Values (T,) on a curve through (time, value) keys that stands still at each; constant outside them."""
    seconds = np.asarray(times, np.float64)
    curve = np.full(seconds.shape, keys[0][1])
    for (begin, low), (end, high) in pairwise(keys):
        share = np.clip((seconds - begin) / (end - begin), 0.0, 1.0)
        curve = curve + (high - low) * share**2 * (3 - 2 * share)
    return curve
