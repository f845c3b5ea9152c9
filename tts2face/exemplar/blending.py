"""Blending of exemplars to one trajectory: time warping, averaging, joining, smoothing (T07 section 3.3)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tts2face.compilation import kernel
from tts2face.exemplar.options import SynthesisOptions
from tts2face.exemplar.phone_substitution import Targets
from tts2face.exemplar.recorded_motion import read_motion
from tts2face.exemplar.time_warping import warp_space, warp_to_reference
from tts2face.exemplar.tokens import Tokens

CLOCK_HZ = 100.0  # rate at which motion is computed; lip motion is below 15 Hz
N_KNOTS = 8  # samples per phone; 10 are no better (docs/decisions/007-exemplar-method.md)
ALIGN_BAND = 1  # maximum warp in knots relative to the best exemplar; 2 lose .002 of r opening
MIN_DEVIATION = 0.15  # lower limit of the deviation between exemplars, relative to a parameter's spread


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
    return AveragedTokens(mean, np.maximum(square - np.square(mean), np.float32(0.0)))


@kernel
def _accumulate_average(corpus, plan, sums, space):  # type: ignore[no-untyped-def]
    chosen, weights, knots, scale, band = plan
    mean, square = sums
    pieces, warp = space
    best, piece, laid = pieces[0], pieces[1], pieces[2]
    for n in range(len(chosen)):
        for e in range(chosen.shape[1]):
            if chosen[n, e] < 0 or weights[n, e] == 0.0:
                continue
            _sample_token(corpus, chosen[n, e], knots, scale, best if e == 0 else piece)
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
    from scipy.ndimage import gaussian_filter1d

    return np.asarray(gaussian_filter1d(values.astype(np.float32), sigma_s * rate_hz, axis=0, mode="nearest"))
