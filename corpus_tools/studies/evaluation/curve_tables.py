"""Learning curves as Markdown tables and as rows for a CSV file.

Figures of a learning curve: means over random choices of the material, their spread, intervals and differences.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from corpus_tools.studies.evaluation.people import FIGURE_HEADS
from corpus_tools.studies.evaluation.scores import IntervalEstimate, interval_of

LOWER_IS_BETTER = frozenset({"dtw_cost"})
Floats = NDArray[np.float64]
ChoiceFigures = Mapping[str, Floats]  # (W,) of each figure: its value, then resamples over utterances


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
        samples: dict[str, dict[str, Floats]] = {}
        for method, each in figures.items():
            for name, _ in FIGURE_HEADS:
                values = np.stack([one[name] for one in each], axis=1)  # (W, C)
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
            name for name, one in self.figures.items() if (one.low > 0 if name in LOWER_IS_BETTER else one.high < 0)
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
                "seconds": one.seconds,
                "n_choices": one.n_choices,
                "figures": {name: {key: asdict(x) for key, x in some.items()} for name, some in one.figures.items()},
            }
            for one in self.points
        ]
        return {
            "n_test": self.n_test,
            "test_seconds": self.test_seconds,
            "base": self.base,
            "points": points,
            "steps": [asdict(one) for one in self.steps],
            "gains": [asdict(one) for one in self.gains],
        }


def compare_points(
    points: Sequence[CurvePoint], *, n_test: int, test_seconds: float, base: str | None
) -> LearningCurve:
    """The curve of the points, in ascending order of their amounts, with all differences."""
    steps = tuple(
        _difference(after, method, before, method) for before, after in pairwise(points) for method in after.figures
    )
    first, *others = points[0].figures
    gains = tuple(_difference(one, first, one, other) for one in points for other in others)
    return LearningCurve(n_test, test_seconds, base, tuple(points), steps, gains)


def _difference(one: CurvePoint, method: str, other: CurvePoint, minus: str) -> CurveDifference:
    figures = {name: interval_of(one.samples[method][name] - other.samples[minus][name]) for name, _ in FIGURE_HEADS}
    return CurveDifference(method, one.seconds, minus, other.seconds, figures)


CSV_HEAD = ("table", "seconds", "method", "minus", "figure", "value", "low", "high", "deviation")
HEADS = dict(FIGURE_HEADS)


def curve_tables(curve: LearningCurve) -> str:
    """Markdown: a table for each figure, the gains of the built talker, and a sentence on the steps."""
    tables = [f"{head}\n\n{_markdown(figure_rows(curve, name))}" for name, head in FIGURE_HEADS]
    return "\n\n".join([*tables, _markdown(gain_rows(curve)), monotony(curve)])


def figure_rows(curve: LearningCurve, figure: str) -> list[tuple[str, ...]]:
    """Heads, and a row for each amount: mean and standard deviation over the choices, one method a column."""
    rows: list[tuple[str, ...]] = [("own material (s)", "choices", *curve.methods)]
    for point in curve.points:
        cells = (_estimate_text(point.figures[method][figure]) for method in curve.methods)
        rows.append((f"{point.seconds:.0f}", str(point.n_choices), *cells))
    return rows


def gain_rows(curve: LearningCurve) -> list[tuple[str, ...]]:
    """Heads, and a row for each amount and other method: differences of the first method with 95 % intervals."""
    rows: list[tuple[str, ...]] = [("own material (s)", f"{curve.methods[0]} minus", *HEADS.values())]
    for one in curve.gains:
        cells = (_interval_text(one.figures[name]) for name in HEADS)
        rows.append((f"{one.seconds:.0f}", one.minus, *cells))
    return rows


def monotony(curve: LearningCurve) -> str:
    """Sentence: whether a figure becomes worse from one amount to the next by more than its interval."""
    names = curve.methods
    worse = [_step_text(one) for name in names for one in curve.steps if one.method == name and one.surely_worse()]
    if not worse:
        return "No figure becomes worse from one amount to the next by more than its 95 % interval."
    return f"Worse than with less material by more than the 95 % interval: {'; '.join(worse)}."


def curve_rows(curve: LearningCurve) -> Iterator[tuple[str, ...]]:
    """All figures and differences; the first row names the columns."""
    yield CSV_HEAD
    for point in curve.points:
        for method, figures in point.figures.items():
            for name, one in figures.items():
                deviation = "" if one.deviation is None else f"{one.deviation:.6g}"
                numbers = (f"{one.value:.6g}", f"{one.low:.6g}", f"{one.high:.6g}", deviation)
                yield "curve", f"{point.seconds:g}", method, "", name, *numbers
    for table, differences in (("step", curve.steps), ("gain", curve.gains)):
        for some in differences:
            minus = f"{some.minus}, {some.minus_seconds:g} s"
            for name, value in some.figures.items():
                numbers = (f"{value.value:.6g}", f"{value.low:.6g}", f"{value.high:.6g}", "")
                yield table, f"{some.seconds:g}", some.method, minus, name, *numbers


def _step_text(one: CurveDifference) -> str:
    figures = ", ".join(HEADS[name] for name in one.surely_worse())
    return f"{one.method} at {one.seconds:.0f} s ({figures})"


def _estimate_text(one: ChoiceEstimate) -> str:
    value = f"{round(one.value, 3) + 0.0:.3f}"  # no minus before 0.000
    return value if one.deviation is None else f"{value} ± {one.deviation:.3f}"


def _interval_text(one: IntervalEstimate) -> str:
    return f"{one.value:+.3f} ({one.low:+.3f} to {one.high:+.3f})"


def _markdown(rows: list[tuple[str, ...]]) -> str:
    lines = [f"| {' | '.join(row)} |" for row in rows]
    return "\n".join([lines[0], "| --- |" + " --- |" * (len(rows[0]) - 1), *lines[1:]])
