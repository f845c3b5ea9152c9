"""Edges of the phones in the sound of a voice that says how long each of them is.

What a voice's network states is exact to a step of it, 25 ms, and its pauses are where punctuation is. The edges are
those of the segments that fit the sound best: a `PhoneClassifier` gives the probability of each phone in frames of
5 ms, and a search over all divisions of the sound adds to them how well each segment keeps the stated duration and
begin (segmental Viterbi search, after Ostendorf et al. 1996).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from lexicon.sequence import SILENCE
from tts2face.models.phone_classifier import PhoneClassifier
from tts2face.numeric.arrays import ordered_product
from tts2face.numeric.kernels import kernel
from tts2face.sound.alignment import enforce_increasing
from tts2face.types import Waveform

RATE, STEP, WINDOW, TRANSFORM = 16_000, 80, 320, 512  # Hz; samples between frames, of a frame, of its spectrum
STEP_S = STEP / RATE
N_BANDS, LOWEST_HZ, HIGHEST_HZ = 40, 60.0, 7800.0
LEAST_POWER = 1e-7
LOUD_SHARE, BAND_SPREAD = 0.5, 3.0  # frames whose mean is the level of a sound; spread of log powers
OFFSETS = (-16, -11, -8, -5, -3, -1, 0, 1, 3, 5, 8, 11, 16)  # frames of the window of a classifier
SCORE_WEIGHT = 0.5  # of log probabilities: those of neighbouring frames are not independent
DURATION_SPREAD = 0.35  # of log durations around the stated ones
BEGIN_SPREAD_S = 0.03  # of begins around the stated ones; a Cauchy distribution, since some are far off
UNMARKED_PAUSE = -3.0  # log probability of a silence between words without punctuation
SHORTEST, SHORTEST_SILENCE = 3, 6  # frames
LONGEST_SHARE = 5  # of the longest stated duration
REACH = 80  # frames around the stated begin, at the usual rate
USUAL_DURATION_S = 0.08  # of phones; what is stated for slower speech is less exact
Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class StatedPhone:
    """A phone, or a silence between words, as a voice states it.

    Parameters
    ----------
    begin, duration
        In seconds.
    may_be_skipped
        Whether it is a silence that the sound may lack.
    is_marked
        Whether punctuation stands at a silence.
    """

    label: str
    begin: float
    duration: float = 0.0
    may_be_skipped: bool = False
    is_marked: bool = False


def find_edges(sound: Waveform, stated: Sequence[StatedPhone], classifier: PhoneClassifier) -> Floats:
    """(N + 1,) begins of N stated phones in seconds, and the end of the sound; a skipped one begins with the next one.

    Parameters
    ----------
    stated
        The first and the last one are silences.
    """
    probabilities = classifier.log_probabilities(frame_features(sound))[:-1]
    n_frames, n_stated = len(probabilities), len(stated)
    sums = np.zeros((n_frames + 1, probabilities.shape[1]))
    np.cumsum(SCORE_WEIGHT * probabilities, axis=0, out=sums[1:])
    number = {label: at for at, label in enumerate(classifier.inventory)}
    labels = np.array([number[one.label] for one in stated])
    begins = np.array([0.0, *(one.begin for one in stated[1:])])
    durations = np.array([one.duration for one in stated])
    slowness = max(1.0, float(durations[durations > 0].mean()) / USUAL_DURATION_S)
    reach = round(REACH * slowness)
    frames = np.clip(np.round(begins / STEP_S).astype(np.int64), 0, n_frames)
    bounds = np.stack([np.maximum(frames - reach, 0), np.minimum(frames + reach, n_frames)], axis=1)
    bounds[0] = 0
    score, before = (np.full((n_stated + 1, n_frames + 1), value) for value in (-np.inf, 0))
    score[0, 0] = 0.0
    is_silence = np.array([one.label == SILENCE for one in stated])
    costs = (*_costs(stated, durations, is_silence), BEGIN_SPREAD_S * slowness / STEP_S)
    _search(sums, (labels, is_silence, frames, bounds), costs, (score, before))
    if not np.isfinite(score[-1, -1]):  # fewer frames than phones need
        return enforce_increasing(np.append(begins, sound.duration))
    edges, at = np.full(n_stated + 1, sound.duration), n_frames
    for n in range(n_stated - 1, -1, -1):
        at = int(before[n + 1, at])
        edges[n] = max((at - 0.5) * STEP_S, 0.0)
    return edges


def _costs(
    stated: Sequence[StatedPhone], durations: Floats, is_silence: NDArray[np.bool_]
) -> tuple[Floats, Floats, NDArray[np.int64]]:
    """Log probabilities (N, D) of durations in frames, that of being (N, 2) skipped and not, and least frames (N,)."""
    expected = np.maximum(durations, STEP_S)
    seconds = np.maximum(np.arange(round(LONGEST_SHARE * expected.max() / STEP_S) + 1), 1) * STEP_S
    likely = -0.5 * np.square(np.log(seconds / expected[:, None]) / DURATION_SPREAD)
    skipped = [
        [0.0, 0.0 if one.is_marked else UNMARKED_PAUSE] if one.may_be_skipped else [-np.inf, 0.0] for one in stated
    ]
    shortest = np.where(is_silence, SHORTEST_SILENCE, SHORTEST)
    shortest[[0, -1]] = 1
    return likely, np.array(skipped), shortest


@kernel
def _search(sums, stated, costs, found):  # type: ignore[no-untyped-def]
    """Write the score (N + 1, T + 1) of the best division of the first t frames into n segments, and where n begins."""
    labels, is_silence, frames, bounds = stated
    durations, skipped, shortest, spread = costs
    score, before = found
    n_frames, longest = sums.shape[0] - 1, durations.shape[1] - 1
    for n in range(len(labels)):
        label = labels[n]
        for begin in range(bounds[n, 0], bounds[n, 1] + 1):
            if score[n, begin] == -np.inf:
                continue
            distance = 0.0 if is_silence[n] else (begin - frames[n]) / spread
            entered = score[n, begin] + skipped[n, 1] - np.log1p(0.5 * distance * distance) - sums[begin, label]
            last = n_frames if is_silence[n] else min(begin + longest, n_frames)
            for end in range(begin + shortest[n], last + 1):
                reached = entered + sums[end, label] + (0.0 if is_silence[n] else durations[n, end - begin])
                if reached > score[n + 1, end]:
                    score[n + 1, end], before[n + 1, end] = reached, begin
            if score[n, begin] + skipped[n, 0] > score[n + 1, begin]:
                score[n + 1, begin], before[n + 1, begin] = score[n, begin] + skipped[n, 0], begin


def frame_features(sound: Waveform) -> NDArray[np.float32]:
    """Log powers of mel bands (T, K) in a window around each frame of 5 ms, relative to the level of the sound."""
    import soxr

    samples = sound.samples if sound.rate == RATE else soxr.resample(sound.samples, sound.rate, RATE)
    padded = np.pad(samples.astype(np.float32), (WINDOW // 2, WINDOW))
    windows = sliding_window_view(padded, WINDOW)[::STEP][: len(samples) // STEP + 1] * np.hanning(WINDOW)
    powers = np.square(np.abs(np.fft.rfft(windows, TRANSFORM)))
    bands = np.log(ordered_product(powers, _mel_bands()) + LEAST_POWER)
    loud = bands.mean(axis=1) >= np.quantile(bands.mean(axis=1), 1.0 - LOUD_SHARE)
    bands = ((bands - bands[loud].mean(axis=0)) / BAND_SPREAD).astype(np.float32)
    rows = np.clip(np.arange(len(bands))[:, None] + np.array(OFFSETS), 0, len(bands) - 1)
    features: NDArray[np.float32] = bands[rows].reshape(len(bands), -1)
    return features


@cache
def _mel_bands() -> Floats:
    """Weights (F, B) of triangular bands, equally wide in mel (O'Shaughnessy 1987)."""
    lowest, highest = (2595.0 * np.log10(1.0 + hertz / 700.0) for hertz in (LOWEST_HZ, HIGHEST_HZ))
    edges = 700.0 * (10.0 ** (np.linspace(lowest, highest, N_BANDS + 2) / 2595.0) - 1.0)
    frequencies = np.linspace(0.0, RATE / 2, TRANSFORM // 2 + 1)[:, None]
    low, middle, high = edges[:-2], edges[1:-1], edges[2:]
    weights: Floats = np.clip(
        np.minimum((frequencies - low) / (middle - low), (high - frequencies) / (high - middle)), 0.0, None
    )
    return weights
