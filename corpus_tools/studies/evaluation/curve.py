"""Figures of a learning curve: means over random choices of the material, their spread, intervals and differences."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from corpus_tools.measures.intervals import IntervalEstimate, interval_of
from corpus_tools.studies.evaluation.people_tables import FIGURE_HEADS
from tts2face.numeric.arrays import FloatArray

LOWER_IS_BETTER = frozenset({"dtw_cost"})
ChoiceFigures = Mapping[str, FloatArray]  # (W,) of each figure: its value, then resamples over utterances


@dataclass(frozen=True, slots=True)
class ChoiceEstimate:
    """Mean of a figure over the choices, its 95 % interval, and the standard deviation over the choices.

    The deviation is None for a single choice.
    """

    value: float
    low: float
    high: float
    deviation: float | None


@dataclass(frozen=True, slots=True, eq=False)
class CurvePoint:
    """One amount of material: mean ``seconds`` of its choices, their number, figures by method and name.

    ``samples`` (W,) are the mean of each figure and its resamples, over held-out utterances and over choices.
    """

    seconds: float
    n_choices: int
    figures: Mapping[str, Mapping[str, ChoiceEstimate]]
    samples: Mapping[str, ChoiceFigures]

    @classmethod
    def of(cls, seconds: float, number: int, figures: Mapping[str, Sequence[ChoiceFigures]]) -> "CurvePoint":
        """From the figures of each choice, by method; ``number`` seeds the resampling of the choices.

        Utterances are resampled alike at all points, choices independently.
        """
        n_choices = len(next(iter(figures.values())))
        n_draws = len(next(iter(figures.values()))[0][FIGURE_HEADS[0][0]]) - 1
        shares = np.random.default_rng([1, number]).multinomial(n_choices, np.full(n_choices, 1 / n_choices), n_draws)
        weights = np.concatenate([np.ones((1, n_choices)), shares]) / n_choices
        estimates: dict[str, dict[str, ChoiceEstimate]] = {}
        samples: dict[str, dict[str, FloatArray]] = {}
        for method, each in figures.items():
            for name, _ in FIGURE_HEADS:
                values = np.stack([item[name] for item in each], axis=1)  # (W, C)
                mean = samples.setdefault(method, {})[name] = np.einsum("wc,wc->w", weights, values)
                deviation = float(values[0].std(ddof=1)) if n_choices > 1 else None
                interval = interval_of(mean)
                estimate = ChoiceEstimate(interval.value, interval.low, interval.high, deviation)
                estimates.setdefault(method, {})[name] = estimate
        return cls(seconds, n_choices, estimates, samples)


@dataclass(frozen=True, slots=True)
class CurveDifference:
    """Figures of a method with some material minus those of another method or amount, with 95 % intervals."""

    method: str
    seconds: float
    minus: str
    minus_seconds: float
    figures: Mapping[str, IntervalEstimate]

    def surely_worse(self) -> tuple[str, ...]:
        """Names of the figures that are worse by more than their interval."""
        return tuple(
            name
            for name, figure in self.figures.items()
            if (figure.low > 0 if name in LOWER_IS_BETTER else figure.high < 0)
        )


@dataclass(frozen=True, slots=True, eq=False)
class LearningCurve:
    """A learning curve: its points by amount, differences from amount to amount, and between methods.

    ``steps`` are differences of each method from the next smaller amount, ``gains`` of the first method from the others
    with the same amount. ``base`` is the name of the base talker, None without one.
    """

    n_test: int
    test_seconds: float
    base: str | None
    points: tuple[CurvePoint, ...]
    steps: tuple[CurveDifference, ...]
    gains: tuple[CurveDifference, ...]

    @property
    def methods(self) -> tuple[str, ...]:
        """Names, the built talker first."""
        return tuple(self.points[0].figures)

    def to_json(self) -> dict[str, Any]:
        """Dictionary for JSON."""
        points = [
            {
                "seconds": point.seconds,
                "n_choices": point.n_choices,
                "figures": {name: {key: asdict(x) for key, x in some.items()} for name, some in point.figures.items()},
            }
            for point in self.points
        ]
        return {
            "n_test": self.n_test,
            "test_seconds": self.test_seconds,
            "base": self.base,
            "points": points,
            "steps": [asdict(step) for step in self.steps],
            "gains": [asdict(gain) for gain in self.gains],
        }


def compare_points(
    points: Sequence[CurvePoint], *, n_test: int, test_seconds: float, base: str | None
) -> LearningCurve:
    """The curve of the points, in ascending order of their amounts, with all differences."""
    steps = tuple(
        _difference(after, method, before, method) for before, after in pairwise(points) for method in after.figures
    )
    first, *others = points[0].figures
    gains = tuple(_difference(point, first, point, other) for point in points for other in others)
    return LearningCurve(n_test, test_seconds, base, tuple(points), steps, gains)


def _difference(point: CurvePoint, method: str, other: CurvePoint, minus: str) -> CurveDifference:
    figures = {name: interval_of(point.samples[method][name] - other.samples[minus][name]) for name, _ in FIGURE_HEADS}
    return CurveDifference(method, point.seconds, minus, other.seconds, figures)
