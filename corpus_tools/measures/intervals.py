"""Intervals of a method's figures over utterances, and of the difference of two methods on the same utterances."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.numeric.arrays import FloatArray

# of the intervals in reports
CONFIDENCE = 0.95
N_PAIRED_DRAWS = 2000  # resamples of utterances with replacement (Efron 1979)
ROUNDING = 1e-12  # spread of a constant curve in parts of its sum of squares: what float32 values and sums leave


@dataclass(frozen=True, slots=True)
class IntervalEstimate:
    """A value and the interval in which it lies with `CONFIDENCE`."""

    value: float
    low: float
    high: float


def curve_moments(a: FloatArray, b: FloatArray) -> FloatArray:
    """(6,) number of frames, sums, and sums of products of a real curve a and a synthesised one b."""
    return np.array([len(a), a.sum(), b.sum(), a @ a, b @ b, a @ b])


@dataclass(frozen=True, slots=True, eq=False)
class PairedCurves:
    """Statistics of a method on U utterances: ``moments`` (U, 2, 6) of opening and width, warping ``costs`` (U,).

    The moments of a real curve a and a synthesised one b are n, sum a, sum b, sum aa, sum bb and sum ab, from which
    Pearson's r of pooled frames follows.
    """

    moments: FloatArray
    costs: FloatArray

    @classmethod
    def of(
        cls, real: Sequence[NDArray[np.floating]], synthesised: Sequence[NDArray[np.floating]], costs: Sequence[float]
    ) -> "PairedCurves":
        """Of real and synthesised curves (T, 2), one pair for each utterance, and their warping costs."""
        moments = [
            [curve_moments(a[:, at].astype(np.float64), b[:, at].astype(np.float64)) for at in range(2)]
            for a, b in zip(real, synthesised, strict=True)
        ]
        return cls(np.array(moments), np.asarray(costs, np.float64))

    def figures(self, weights: FloatArray) -> Mapping[str, FloatArray]:
        """Correlations of opening and width, pooled and within, and mean cost for each row of weights (W, U)."""
        return {**correlations(weights, self.moments), "dtw_cost": weights @ self.costs / weights.sum(axis=1)}


def draw_weights(n_utterances: int) -> FloatArray:
    """(N_DRAWS + 1, U) number of times each utterance is drawn; every utterance once in the first row."""
    draws = np.random.default_rng(0).multinomial(n_utterances, np.full(n_utterances, 1 / n_utterances), N_PAIRED_DRAWS)
    return np.concatenate([np.ones((1, n_utterances)), draws])


def estimate(pairs: PairedCurves) -> Mapping[str, IntervalEstimate]:
    """Each figure with its interval."""
    figures = pairs.figures(draw_weights(len(pairs.costs)))
    return {name: interval_of(values) for name, values in figures.items()}


def estimate_difference(first: PairedCurves, second: PairedCurves) -> Mapping[str, IntervalEstimate]:
    """Figures of `first` minus those of `second` on the same utterances; both are resampled together.

    Raises
    ------
    InputError
        The two have other numbers of utterances.
    """
    if len(first.costs) != len(second.costs):
        raise InputError(f"{len(first.costs)} utterances cannot be paired with {len(second.costs)}; use the same ones")
    weights = draw_weights(len(first.costs))
    ours, theirs = first.figures(weights), second.figures(weights)
    return {name: interval_of(ours[name] - theirs[name]) for name in ours}


def interval_of(values: FloatArray) -> IntervalEstimate:
    """The first of (W,) values, with the interval that holds `CONFIDENCE` of the others."""
    low, high = np.quantile(values[1:], (0.5 - CONFIDENCE / 2, 0.5 + CONFIDENCE / 2))
    return IntervalEstimate(float(values[0]), float(low), float(high))


def correlations(weights: FloatArray, moments: FloatArray) -> dict[str, FloatArray]:
    """Correlations of opening and width by name, pooled and within utterances, for moments (U, 2, 6)."""
    n, a, b, aa, bb, ab = np.moveaxis(moments, -1, 0)
    left, zero = [(aa - a * a / n, aa), (bb - b * b / n, bb)], np.zeros_like(n)
    spreads = (np.where(spread > ROUNDING * whole, spread, 0.0) for spread, whole in left)
    within = np.stack([n, zero, zero, *spreads, ab - a * b / n], axis=-1)
    names = {"": moments, "_within": within}
    return {
        f"r_{name}{suffix}": _pooled_correlation(weights @ kept[:, at])
        for suffix, kept in names.items()
        for at, name in enumerate(("opening", "width"))
    }


def _pooled_correlation(moments: FloatArray) -> FloatArray:
    """(W,) Pearson's r for moments (W, 6); 0 where a curve is constant but for rounding."""
    n, a, b, aa, bb, ab = moments.T
    spread_a, spread_b = aa - a * a / n, bb - b * b / n
    moves = (spread_a > ROUNDING * aa) & (spread_b > ROUNDING * bb)
    return np.where(moves, ab - a * b / n, 0.0) / np.sqrt(np.where(moves, spread_a * spread_b, 1.0))
