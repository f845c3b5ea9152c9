"""Alignment of phones with lip features, without sound: semi-Markov Viterbi search.

Each third of a phone emits features whose mean depends on the phones around it (a network, trained on recordings whose
phone times are known, then on those and the alignments found); their residuals are Gaussian. Durations are log-normal.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from corpus_tools.training.network_training import (
    TrainingOptions,
    Weights,
    WindowSamples,
    network_outputs,
    train_network,
)
from lexicon.errors import DataError
from lexicon.phones import look_up_phone
from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.numeric.arrays import FloatArray
from tts2face.numeric.kernels import kernel

RATE_HZ = 50  # of the alignment
ALIGNED = (0, 1, 2, 3, 5)  # `lip_features.FEATURES` that the alignment compares; the others are noisier
DELTA_SPAN = 2  # frames on either side of a frame from which its velocity is computed
DELTA_SCALE = 1.6
NEIGHBOURS = 3  # phones on either side that determine the means
N_PARTS = 3  # of a phone
FRAME_WEIGHT = 0.35  # of the log likelihood of a frame: neighbouring frames are correlated
SPREAD_OF_LOG_DURATION = 0.45
MIN_FRAMES, MAX_FRAMES, MAX_SILENCE = 2, 18, 150
SILENCE_COST = 2.0  # of inserting a silence between words
LONG_SILENCE_COST, LONG_SILENCE = 0.02, 10  # for each frame beyond the tenth
WINDOWS_S = (0.8, 1.5, 3.0, 6.0)  # tried in turn, around the expected time of each edge
TRAINING = TrainingOptions(hidden=(96, 64), n_epochs=8, weight_decay=1e-5)
MIN_VARIANCE = 1e-6  # of residuals, of about unit variance: few silent parts have a singular covariance
UNREACHED = 1e17
# Durations in seconds of unstressed running speech, by class of phone; order of Crystal and House 1988.
DURATIONS_S = {
    "silence": 0.15, "schwa": 0.05, "diphthong": 0.14, "lax vowel": 0.085, "vowel": 0.11, "affricate": 0.11,
    "plosive": 0.065, "voiceless fricative": 0.09, "other": 0.06,
}  # fmt: skip
LAX_VOWELS = frozenset("ɪʊʌɛɚ")


@dataclass(frozen=True, slots=True, eq=False)
class LipSpeech:
    """z-scored features (T, F) at `RATE_HZ` and the phones in time."""

    features: FloatArray
    phones: PhoneSequence


@dataclass(frozen=True, slots=True, eq=False)
class PartModel:
    """Means of the parts of phones in context, by a network, and the Gaussian of their residuals.

    ``precision`` (2, F, F) and ``log_determinant`` (2,) are those of speech and of silence.
    """

    weights: Weights
    table: NDArray[np.float32]
    inventory: tuple[str, ...]
    precision: FloatArray
    log_determinant: FloatArray


def alignment_features(features: FloatArray, fps: float) -> FloatArray:
    """(U, 10) features and velocities at `RATE_HZ` of z-scored features (T, 8)."""
    from scipy.interpolate import CubicSpline

    kept = features[:, list(ALIGNED)]
    times = np.arange(len(kept)) / fps
    dense = CubicSpline(times, kept)(np.arange(int(times[-1] * RATE_HZ) + 1) / RATE_HZ)
    velocity = np.zeros_like(dense)
    velocity[DELTA_SPAN:-DELTA_SPAN] = (dense[2 * DELTA_SPAN :] - dense[: -2 * DELTA_SPAN]) / DELTA_SCALE
    return np.concatenate([dense, velocity], axis=1)


def fit_part_model(
    known: Sequence[LipSpeech], aligned: Sequence[LipSpeech], inventory: tuple[str, ...], table: NDArray[np.float32]
) -> PartModel:
    """Model of recordings with known phone times, and of alignments of another speaker."""
    number = {label: at for at, label in enumerate(inventory)}
    parts = [[_part_samples(item, number) for item in group] for group in (known, aligned)]
    samples = [tuple(np.concatenate(column) for column in zip(*group, strict=True)) for group in parts if group]
    shown, position, targets = (np.concatenate(column) for column in zip(*samples, strict=True))
    speaker = np.repeat(np.arange(len(samples)), [len(sample[0]) for sample in samples])
    importance = np.ones((len(samples), targets.shape[1]), np.float32)
    joined = WindowSamples(shown, position, targets, speaker)
    weights = train_network(joined, table, importance, options=TRAINING, seed=0)
    predicted = network_outputs(weights, table, samples[-1][0], samples[-1][1], len(samples) - 1)
    residuals = (samples[-1][2] - predicted).astype(np.float64)
    silent = samples[-1][0][:, NEIGHBOURS] == number[SILENCE]
    precision, log_determinant = [], []
    for here in (~silent, silent):
        unit = np.eye(residuals.shape[1])
        inverse = np.linalg.inv(np.cov(residuals[here].T) + MIN_VARIANCE * unit) + 0.05 * unit
        precision.append(inverse)
        log_determinant.append(-np.linalg.slogdet(inverse)[1])
    return PartModel(weights, table, inventory, np.array(precision), np.array(log_determinant))


def _part_samples(
    speech: LipSpeech, number: dict[str, int]
) -> tuple[NDArray[np.int32], NDArray[np.float32], NDArray[np.float32]]:
    """Phones around each part of each phone (N, 7), the part (N, 3), and the features in its middle (N, F)."""
    labels = np.array([number[label] for label in speech.phones.phones])
    edges = speech.phones.edges
    middles = edges[:-1, None] + np.diff(edges)[:, None] * (np.arange(N_PARTS) + 0.5) / N_PARTS
    at = middles.reshape(-1) * RATE_HZ
    kept = (at < len(speech.features) - 1) & ~np.repeat(
        (labels == number[SILENCE]) & (np.diff(edges) > 0.6), N_PARTS
    )  # silences longer than .6 s are rest
    low = at[kept].astype(int)
    part = (at[kept] - low)[:, None]
    seen = (1 - part) * speech.features[low] + part * speech.features[low + 1]
    around = _contexts(labels, number[SILENCE])
    position = np.tile(np.eye(N_PARTS, dtype=np.float32), (len(labels), 1))
    return np.repeat(around, N_PARTS, axis=0)[kept], position[kept], seen.astype(np.float32)


def _contexts(labels: NDArray[np.integer], silence: int) -> NDArray[np.int32]:
    """(N, 7) phones around each phone, silence beyond the ends."""
    padded = np.concatenate([np.full(NEIGHBOURS, silence), labels, np.full(NEIGHBOURS, silence)])
    return np.stack([padded[at : at + len(labels)] for at in range(2 * NEIGHBOURS + 1)], axis=1).astype(np.int32)


def align_phones(
    features: FloatArray,
    labels: Sequence[str],
    is_optional: NDArray[np.bool_],
    expected: FloatArray,
    model: PartModel,
    *,
    speaker: int,
) -> tuple[FloatArray, float]:
    """End of each phone in seconds, near its expected one, and the cost of the alignment per frame."""
    means = _part_means(labels, is_optional, model, speaker)
    n_frames = len(features)
    silent = np.array([label == SILENCE for label in labels])
    log_durations = np.log(np.array([typical_duration(label) for label in labels]) * RATE_HZ)
    longest = np.where(silent, MAX_SILENCE, MAX_FRAMES)
    for window in WINDOWS_S:
        low, high = (
            np.maximum.accumulate(np.clip(((expected + side * window) * RATE_HZ).astype(int), 0, n_frames - 1))
            for side in (-1, 1)
        )
        costs = _window_costs(features, means, silent, low, high, model)
        ends = np.zeros(len(low) + 1, np.int64)
        cost = _search_edges(costs, low, high, (log_durations, is_optional, silent, longest), ends)
        if cost < UNREACHED:
            return (ends[1:] - 0.5) / RATE_HZ, cost / n_frames  # an edge lies halfway between two frames
    raise DataError(f"{len(labels)} phones do not fit into {n_frames / RATE_HZ:.1f} s of lips; check the text")


def typical_duration(label: str) -> float:
    """Seconds."""
    phone = look_up_phone(label)
    if label == SILENCE:
        return DURATIONS_S["silence"]
    if phone.is_vowel:
        kind = (
            "schwa" if label == "ə" else "diphthong" if phone.parts else "lax vowel" if label in LAX_VOWELS else "vowel"
        )
        return DURATIONS_S[kind]
    if phone.parts:
        return DURATIONS_S["affricate"]
    if phone.manner == "plosive":
        return DURATIONS_S["plosive"]
    is_hissed = phone.manner in {"sibilant", "fricative"} and not phone.is_voiced
    return DURATIONS_S["voiceless fricative" if is_hissed else "other"]


def _part_means(labels: Sequence[str], is_optional: NDArray[np.bool_], model: PartModel, speaker: int) -> FloatArray:
    """(N, 3, F) means; the context of a phone skips optional silences."""
    number = {label: at for at, label in enumerate(model.inventory)}
    coded = np.array([number[label] for label in labels])
    core = coded[~is_optional]
    position = np.cumsum(~is_optional)  # of the next obligatory phone
    around = np.zeros((len(labels), 2 * NEIGHBOURS + 1), np.int32)
    around[~is_optional] = _contexts(core, number[SILENCE])
    padded = np.concatenate([np.full(NEIGHBOURS, number[SILENCE]), core, np.full(NEIGHBOURS, number[SILENCE])])
    for at in np.flatnonzero(is_optional):
        here = position[at] + NEIGHBOURS
        around[at] = [*padded[here - NEIGHBOURS : here], number[SILENCE], *padded[here : here + NEIGHBOURS]]
    shown = np.repeat(around, N_PARTS, axis=0)
    parts = np.tile(np.eye(N_PARTS, dtype=np.float32), (len(labels), 1))
    means = network_outputs(model.weights, model.table, shown, parts, speaker)
    return means.reshape(len(labels), N_PARTS, -1).astype(np.float64)


def _window_costs(
    features: FloatArray,
    means: FloatArray,
    silent: NDArray[np.bool_],
    low: NDArray[np.integer],
    high: NDArray[np.integer],
    model: PartModel,
) -> FloatArray:
    """(N, 3, W) cumulative costs of the frames from `MAX_SILENCE` before each window on."""
    width = int((high - low).max()) + MAX_SILENCE + 1
    costs = np.zeros((*means.shape[:2], width + 1))
    for at in range(len(means)):
        frames = np.clip(np.arange(width) + low[at] - MAX_SILENCE, 0, len(features) - 1)
        kind = int(silent[at])
        for part in range(N_PARTS):
            apart = features[frames] - means[at, part]
            squared = np.einsum("td,td->t", apart @ model.precision[kind], apart)
            costs[at, part, 1:] = np.cumsum(0.5 * (squared + model.log_determinant[kind]))
    return costs


@kernel
def _search_edges(costs, low, high, rules, ends):  # type: ignore[no-untyped-def]
    """Write the cheapest ends (N + 1,) in frames, of which the first is the start; the result is the cost."""
    log_durations, is_optional, silent, longest = rules
    n = len(low)
    best = np.full(high[-1] + 1, 1e18)
    best[low[0] : high[0] + 1] = 0.0
    starts = np.full((n, (high - low).max() + 1), -1, np.int32)
    for i in range(n):
        reached = np.full(len(best), 1e18)
        for end in range(low[i], high[i] + 1):
            if is_optional[i]:
                reached[end], starts[i, end - low[i]] = best[end], end
            rule = (low[i], silent[i], log_durations[i], longest[i])
            cost, start = _cheapest_start(costs[i], best, end, rule)
            if cost < reached[end]:
                reached[end], starts[i, end - low[i]] = cost, start
        best = reached
    ends[n] = low[n - 1] + np.argmin(best[low[n - 1] : high[n - 1] + 1])
    least = best[ends[n]]
    if least < UNREACHED:
        for i in range(n - 1, -1, -1):
            ends[i] = starts[i, ends[i + 1] - low[i]]
    return least


@kernel
def _cheapest_start(costs, best, end, rule):  # type: ignore[no-untyped-def]
    """Least cost of a phone that ends at a frame, with all before it, and its start; `UNREACHED` and -1 if none."""
    low, silent, log_duration, longest = rule
    least, chosen = UNREACHED, -1
    for length in range(MIN_FRAMES, min(longest, end) + 1):
        start = end - length
        if best[start] < UNREACHED:
            cost = best[start] + _phone_cost(costs, start - low + MAX_SILENCE, length, silent, log_duration)
            if cost < least:
                least, chosen = cost, start
    return least, chosen


@kernel
def _phone_cost(costs, start, length, silent, log_duration):  # type: ignore[no-untyped-def]
    total = 0.0
    for part in range(N_PARTS):
        first_frame, end = start + (length * part) // N_PARTS, start + (length * (part + 1)) // N_PARTS
        if end > first_frame:
            total += costs[part, end] - costs[part, first_frame]
    total *= FRAME_WEIGHT
    if silent:
        return total + SILENCE_COST + LONG_SILENCE_COST * max(length - LONG_SILENCE, 0)
    apart = (np.log(length) - log_duration) / SPREAD_OF_LOG_DURATION
    return total + 0.5 * apart * apart
