"""Blending of exemplars to one trajectory: time warping, averaging, joining, smoothing (T07 section 3.3).

Dynamic time warping of trajectories.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.lips.options import SynthesisOptions
from tts2face.lips.targets import Targets
from tts2face.lips.tokens import Tokens, read_motion
from tts2face.numeric.arrays import FloatArray, IntArray
from tts2face.numeric.filters import gaussian
from tts2face.numeric.kernels import inlined_kernel, kernel

CLOCK_HZ = 100.0  # rate at which motion is computed; lip motion is below 15 Hz
N_KNOTS = 8  # samples per phone; 10 are no better (docs/decisions/007-exemplar-method.md)
ALIGN_BAND = 1  # maximum warp in knots relative to the best exemplar; 2 lose .002 of r opening
MIN_DEVIATION = 0.15  # lower limit of the deviation between exemplars, relative to a parameter's spread


def warp_path(cost: NDArray[np.floating], *, band: int | None = None) -> IntArray:
    """Cheapest monotone path through a cost matrix.

    Parameters
    ----------
    cost : (N, M)
        ``cost[i, j]`` is the distance of source frame i from target frame j; finite, not negative.
    band
        Where given, ``|i - j|`` is at most this many frames (Sakoe and Chiba's adjustment window).

    Returns
    -------
    (L, 2)
        Frame pairs from (0, 0) to (N - 1, M - 1), neither index falling.

    Notes
    -----
    Symmetric steps without slope limit; of equally cheap steps the diagonal one is taken, then the one along the
    source. O(N M) time and memory. Source: Sakoe and Chiba 1978.
    """
    costs = np.ascontiguousarray(cost, dtype=np.float64)
    if costs.ndim != 2 or costs.size == 0:
        raise InputError(f"a warp path needs a cost matrix with frames on both sides, not shape {costs.shape}")
    if not np.isfinite(costs).all() or (costs < 0).any():
        raise InputError("warping costs must be finite and not negative")
    width = max(costs.shape) if band is None else band
    if abs(costs.shape[0] - costs.shape[1]) > width:
        raise InputError(f"a band of {band} frames cannot join {costs.shape[0]} frames to {costs.shape[1]}; widen it")
    space = path_space(*costs.shape)
    path = space[2]
    return np.asarray(path[len(path) - _cheapest_path(costs, width, space) :])


def path_cost(cost: NDArray[np.floating], path: IntArray) -> float:
    """Sum of the costs along a path."""
    return float(cost[path[:, 0], path[:, 1]].sum())


def frame_distances(source: NDArray[np.floating], target: NDArray[np.floating]) -> FloatArray:
    """(N, M) Euclidean distances of (N, D) source frames from (M, D) target frames."""
    apart = source[:, None, :].astype(np.float64) - target[None, :, :]
    return np.asarray(np.sqrt(np.square(apart).sum(-1)))


def path_space(n: int, m: int) -> tuple[NDArray[Any], ...]:
    """Arrays of the search for a path: costs of paths (n, m), their last steps, and the path (n + m - 1, 2)."""
    return np.zeros((n, m)), np.zeros((n, m), np.int8), np.zeros((n + m - 1, 2), np.int64)


def warp_space(n: int) -> tuple[Any, ...]:
    """Arrays of `warp_to_reference` for n samples: distances (n, n), sums and counts (2, n), and `path_space`."""
    return np.zeros((n, n)), np.zeros((2, n)), path_space(n, n)


@inlined_kernel
def _forget(total):  # type: ignore[no-untyped-def]
    for i in range(total.shape[0]):
        for j in range(total.shape[1]):
            total[i, j] = np.inf


@kernel
def _cheapest_path(cost, band, space):  # type: ignore[no-untyped-def]
    """Write the path at the end of the third array of `path_space`; returns its length."""
    n, m = cost.shape
    total, came, path = space  # steps: 0 diagonal, 1 along the source, 2 along the target
    _forget(total)
    for i in range(n):
        for j in range(max(0, i - band), min(m, i + band + 1)):
            if i == 0 and j == 0:
                total[0, 0] = cost[0, 0]
                continue
            step = 0
            best = np.inf
            if i > 0 and j > 0:
                best = total[i - 1, j - 1]
            if i > 0 and total[i - 1, j] < best:
                best, step = total[i - 1, j], 1
            if j > 0 and total[i, j - 1] < best:
                best, step = total[i, j - 1], 2
            total[i, j] = best + cost[i, j]
            came[i, j] = step
    i = n - 1
    j = m - 1
    at = n + m - 2
    path[at, 0], path[at, 1] = i, j
    while i > 0 or j > 0:
        step = came[i, j]
        i -= step != 2
        j -= step != 1
        at -= 1
        path[at, 0], path[at, 1] = i, j
    return n + m - 1 - at


@kernel
def warp_to_reference(source, reference, scale, band, out, space):  # type: ignore[no-untyped-def]
    """Write (S, D) source into `out`, resampled so that its events coincide with those of an (S, D) reference.

    `scale` (D,) converts the arrays from millimetres to their units; frames are compared in millimetres. The path
    is limited to `band` samples. `space` is that of `warp_space`.
    """
    n, n_dims = source.shape
    cost, (total, count), paths = space
    path = paths[2]
    for i in range(n):
        total[i] = count[i] = 0.0
        for j in range(max(0, i - band), min(n, i + band + 1)):
            cost[i, j] = 0.0
            for k in range(n_dims):
                cost[i, j] += ((source[i, k] - reference[j, k]) / scale[k]) ** 2
    length = _cheapest_path(cost, band, paths)
    for at in range(len(path) - length, len(path)):
        total[path[at, 1]] += path[at, 0]
        count[path[at, 1]] += 1.0
    for j in range(n):
        time = total[j] / count[j] if 0 < j < n - 1 else float(j)
        low = min(int(time), n - 2)
        part = time - low
        for k in range(n_dims):
            out[j, k] = (1.0 - part) * source[low, k] + part * source[low + 1, k]


@dataclass(frozen=True, slots=True, eq=False)
class AveragedTokens:
    """Averaged exemplars of N targets at S knots: mean and variance (N, S, D), both in units of the spread."""

    mean: NDArray[np.float32]
    variance: NDArray[np.float32]


def exemplar_weights(scores: NDArray[np.float64], sharpness: float) -> NDArray[np.float64]:
    """(N, k) weights that sum to 1: ``exp(-sharpness (best - score))``, 0 where there is no exemplar."""
    present = np.isfinite(scores)
    behind = np.where(present, scores - scores[:, :1], 0.0)
    weights = np.where(present, np.exp(sharpness * behind), 0.0)
    return np.asarray(weights / weights.sum(1, keepdims=True))


def average_tokens(
    tokens: Tokens,
    chosen: NDArray[np.int32],
    weights: NDArray[np.float64],
    spread: NDArray[np.float32],
    options: SynthesisOptions,
) -> AveragedTokens:
    """Average of the chosen tokens of each target, laid knot on knot.

    Parameters
    ----------
    chosen, weights : (N, k)
        Tokens of each target (-1 = none) and their weights.
    spread : (D,)
        Standard deviation of each parameter.

    Notes
    -----
    Every token is sampled at the same parts of its phone (and of its neighbours, where pieces overlap), which warps it
    to the target's duration; with `options.align`, it is first warped in time onto the best token.
    """
    # with the halves of both neighbours, with which exemplars overlap (decision 007)
    parts = np.arange(3) if options.overlap else np.array([1])
    knots = np.concatenate([part + np.arange(N_KNOTS) / N_KNOTS for part in parts] + [[parts[-1] + 1.0]])
    shape = (len(chosen), len(knots), tokens.frames.shape[1])
    mean, square = np.zeros(shape, np.float32), np.zeros(shape, np.float32)
    _accumulate_average(
        (tokens.frames, tokens.first_frame, tokens.utterance, tokens.spans, tokens.fps),
        (chosen, weights, knots, 1.0 / spread, ALIGN_BAND if options.align else 0),
        (mean, square),
        (np.zeros((3, *shape[1:]), np.float32), warp_space(len(knots))),
    )
    # a variance below 0 is rounding
    return AveragedTokens(mean, np.maximum(square - np.square(mean), np.float32(0.0)))


@kernel
def _accumulate_average(corpus, plan, sums, space):  # type: ignore[no-untyped-def]
    chosen, weights, knots, scale, band = plan
    mean, square = sums
    pieces, warp = space
    best = pieces[0]
    piece = pieces[1]
    laid = pieces[2]
    for n in range(len(chosen)):
        for e in range(chosen.shape[1]):
            if chosen[n, e] < 0 or weights[n, e] == 0.0:
                continue
            _sample_token(corpus, chosen[n, e], knots, scale, best if e == 0 else piece)
            # the best exemplar is the one that the others are warped onto
            if e > 0 and band > 0:
                warp_to_reference(piece, best, scale, band, laid, warp)
            _add_weighted(best if e == 0 else (laid if band > 0 else piece), weights[n, e], mean[n], square[n])


@kernel
def _sample_token(corpus, token, knots, scale, piece):  # type: ignore[no-untyped-def]
    """Write a token's motion at the knots, in units of the spread, into (S, D) `piece`."""
    frames, first_frame, utterance, spans, fps = corpus
    first, last = first_frame[utterance[token]], first_frame[utterance[token] + 1]
    for s in range(len(knots)):
        part = min(int(knots[s]), 2)
        start, end = spans[token, part], spans[token, part + 1]
        read_motion(frames, first, last, (start + (end - start) * (knots[s] - part)) * fps, piece[s])
        for d in range(len(scale)):
            piece[s, d] *= scale[d]


@kernel
def _add_weighted(piece, weight, mean, square):  # type: ignore[no-untyped-def]
    for s in range(piece.shape[0]):
        for d in range(piece.shape[1]):
            mean[s, d] += weight * piece[s, d]
            square[s, d] += weight * piece[s, d] * piece[s, d]


def join_averages(
    pieces: AveragedTokens, targets: Targets, n_instants: int, options: SynthesisOptions
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Join averaged tokens by weighted overlap-add.

    Returns
    -------
    joined : (n, D)
        Motion at the times ``i / CLOCK_HZ`` in units of the spread.
    is_covered : (n,)
        Whether any token covers the time.

    Notes
    -----
    The weight of a token is 1 within its phone and falls linearly to 0 at the far edges of the neighbouring phones,
    times the inverse variance of its exemplars to the power `options.precision`.
    """
    total = np.zeros((n_instants, pieces.mean.shape[2]), np.float32)
    weight = np.zeros_like(total)
    _overlap_add((pieces.mean, pieces.variance, targets.spans), options.overlap, options.precision, total, weight)
    is_covered = weight[:, 0] > 0
    safe_weight = np.where(is_covered[:, None], weight, 1.0)
    return np.where(is_covered[:, None], total / safe_weight, 0.0).astype(np.float32), is_covered


@kernel
def _overlap_add(pieces, overlap, precision, total, weight):  # type: ignore[no-untyped-def]
    mean, variance, spans = pieces
    n_knots, n_dims = mean.shape[1:]
    n_parts = 3 if overlap else 1
    for n in range(len(mean)):
        span = spans[n]
        low, high = (span[0], span[3]) if overlap else (span[1], span[2])
        for i in range(max(0, int(np.ceil(low * CLOCK_HZ))), min(len(total), int(np.floor(high * CLOCK_HZ)) + 1)):
            t = i / CLOCK_HZ
            part = 0 if t < span[1] else (1 if t <= span[2] else 2)
            within = (t - span[part]) / max(span[part + 1] - span[part], 1e-6)
            share = 1.0
            if part != 1:
                share = max(within if part == 0 else 1.0 - within, 1e-3)
            at = (part + within if overlap else within) * (n_knots - 1) / n_parts
            low_knot = min(int(at), n_knots - 2)
            u = at - low_knot
            for d in range(n_dims):
                value = (1.0 - u) * mean[n, low_knot, d] + u * mean[n, low_knot + 1, d]
                spread = (1.0 - u) * variance[n, low_knot, d] + u * variance[n, low_knot + 1, d]
                w = share / (spread + MIN_DEVIATION**2) ** precision
                total[i, d] += w * value
                weight[i, d] += w


def gaussian_smooth(values: NDArray[np.floating], sigma_s: float, rate_hz: float) -> NDArray[np.float32]:
    """Smooth (T, D) values at `rate_hz` by a Gaussian with a standard deviation of `sigma_s` seconds.

    The values are held beyond the ends. `sigma_s` = 0 returns a copy.
    """
    if sigma_s == 0:
        return np.array(values, np.float32)
    return gaussian(values.astype(np.float32), sigma_s * rate_hz)
