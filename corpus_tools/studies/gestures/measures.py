"""Measures of gestures: speeds, spectra, distances of distributions, correlation, diversity, coverage, repetition.

Motion is (T, k): recordings of `lengths` (R,) frames each, concatenated. No measure crosses their borders.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import welch
from scipy.spatial.distance import cdist
from scipy.stats import wasserstein_distance

from tts2face.numeric.arrays import FloatArray

FAST_HZ = 6.0  # motion of head or brows above this is perceived as trembling
SEGMENT = 64  # frames of a spectrum's window: 2.1 s, which a recording of 3 s holds
Motion = NDArray[np.floating]
Lengths = NDArray[np.int32]


def split_recordings(values: Motion, lengths: Lengths) -> list[Motion]:
    """The recordings, split again."""
    return np.split(values, np.cumsum(lengths)[:-1])


def wasserstein(motion: Motion, other: Motion) -> float:
    """Wasserstein distance of two sets of numbers, in their unit; NaN where one is empty."""
    return float(wasserstein_distance(motion, other)) if len(motion) and len(other) else float("nan")


def random_halves(n: int, n_times: int, generator: np.random.Generator) -> Iterator[tuple[NDArray[np.int64], ...]]:
    """`n_times` pairs of random halves of the indices below n."""
    for _ in range(n_times):
        order = generator.permutation(n)
        yield order[: n // 2], order[n // 2 :]


@dataclass(frozen=True, slots=True, eq=False)
class Spectrum:
    """Power (F,) of frequencies (F,) in Hz: squared units per Hz, summed over the channels."""

    hz: FloatArray
    power: FloatArray

    @property
    def fast_power(self) -> float:
        """Power above `FAST_HZ`."""
        return float(self.power[self.hz >= FAST_HZ].sum() * (self.hz[1] - self.hz[0]))


def spectrum(values: Motion, lengths: Lengths, fps: float) -> Spectrum:
    """Mean power spectrum of the recordings without their means (Welch 1967; Hann windows of `SEGMENT` frames)."""
    total: FloatArray | None = None
    hz: Motion = np.zeros(0)
    used = 0
    for part in split_recordings(values, lengths):
        # welch would shorten its window, and the frequencies would differ from the others'
        if len(part) < SEGMENT:
            continue
        level = part.astype(np.float64) - part.mean(axis=0, dtype=np.float64)
        hz, power = welch(level, fps, nperseg=SEGMENT, axis=0)
        whole = np.asarray(power.sum(axis=1), np.float64) * len(part)
        total = whole if total is None else total + whole
        used += len(part)
    if total is None:
        return Spectrum(np.fft.rfftfreq(SEGMENT, 1 / fps).astype(np.float64), np.full(SEGMENT // 2 + 1, np.nan))
    return Spectrum(np.asarray(hz, np.float64), total / used)


def ratio(value: float, other: float) -> float:
    """The quotient; NaN where the divisor is 0."""
    return value / other if other else float("nan")


def frame_midpoints(values: Motion, lengths: Lengths) -> FloatArray:
    """(T - R,) means of neighbouring frames of (T,): values at the instants of finite differences."""
    return np.concatenate([(part[1:] + part[:-1]) / 2.0 for part in split_recordings(values, lengths)])


def diversity(clips: Sequence[Motion], takes: Sequence[Motion]) -> float:
    """Mean distance between clips of different seeds, over that between different takes of the same length.

    The distance is the root mean square over frames. 0: all seeds give the same motion; 1: clips differ as much as
    recordings.
    """
    return ratio(_mean_distance(clips), _mean_distance(takes))


def _mean_distance(clips: Sequence[Motion]) -> float:
    flat = np.stack([clip.astype(np.float64).ravel() for clip in clips])
    gaps = cdist(flat, flat)
    return float(gaps[np.triu_indices(len(flat), 1)].mean() / np.sqrt(len(clips[0])))


def coverage(shown: NDArray[np.int64], lengths: Lengths, within: int) -> float:
    """Share of recorded moments within `within` frames of a moment in `shown`, in the same recording."""
    edges = np.concatenate([[0], np.cumsum(lengths)])
    visited = np.zeros(edges[-1], bool)
    moments = np.unique(shown)
    at = np.searchsorted(edges, moments, side="right") - 1
    for moment, low, high in zip(moments, edges[at], edges[at + 1], strict=True):
        visited[max(low, moment - within) : min(high, moment + within + 1)] = True
    return float(visited.mean())


def autocorrelation(values: Motion, most: int) -> FloatArray:
    """(most + 1,) autocorrelation of a clip at lags of 0 to `most` frames, over all channels; 1 at lag 0.

    Close to 1 at the period of a repetition. Each lag is averaged over its number of frame pairs.
    """
    centred = values.astype(np.float64) - values.mean(axis=0, dtype=np.float64)
    size = 1 << int(np.ceil(np.log2(2 * len(centred))))
    power = np.abs(np.fft.rfft(centred, size, axis=0)) ** 2
    sums = np.fft.irfft(power.sum(axis=1), size)[: most + 1]
    means = sums / (len(centred) - np.arange(most + 1))
    return np.asarray(means / means[0])
