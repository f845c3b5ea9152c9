"""Learning curves as Markdown tables and as rows for a CSV file."""

from collections.abc import Iterator

from corpus_tools.studies.evaluation.curve import ChoiceEstimate, CurveDifference, LearningCurve
from corpus_tools.studies.evaluation.people_tables import FIGURE_HEADS, interval_text
from corpus_tools.studies.report import markdown_table

CSV_HEAD = ("table", "seconds", "method", "minus", "figure", "value", "low", "high", "deviation")
HEADS = dict(FIGURE_HEADS)


def curve_tables(curve: LearningCurve) -> str:
    """Markdown: a table for each figure, the gains of the built talker, and a sentence on the steps."""
    tables = [f"{head}\n\n{markdown_table(figure_rows(curve, name))}" for name, head in FIGURE_HEADS]
    return "\n\n".join([*tables, markdown_table(gain_rows(curve)), monotony(curve)])


def figure_rows(curve: LearningCurve, figure: str) -> list[tuple[str, ...]]:
    """Heads, and a row for each amount: mean and standard deviation over the choices, one method a column."""
    return [
        ("own material (s)", "choices", *curve.methods),
        *(
            (
                f"{point.seconds:.0f}",
                str(point.n_choices),
                *(_estimate_text(point.figures[method][figure]) for method in curve.methods),
            )
            for point in curve.points
        ),
    ]


def gain_rows(curve: LearningCurve) -> list[tuple[str, ...]]:
    """Heads, and a row for each amount and other method: differences of the first method with 95 % intervals."""
    return [
        ("own material (s)", f"{curve.methods[0]} minus", *HEADS.values()),
        *(
            (f"{gain.seconds:.0f}", gain.minus, *(interval_text(gain.figures[name], signed=True) for name in HEADS))
            for gain in curve.gains
        ),
    ]


def monotony(curve: LearningCurve) -> str:
    """Sentence: whether a figure becomes worse from one amount to the next by more than its interval."""
    names = curve.methods
    worse = [_step_text(step) for name in names for step in curve.steps if step.method == name and step.surely_worse()]
    if not worse:
        return "No figure becomes worse from one amount to the next by more than its 95 % interval."
    return f"Worse than with less material by more than the 95 % interval: {'; '.join(worse)}."


def curve_rows(curve: LearningCurve) -> Iterator[tuple[str, ...]]:
    """All figures and differences; the first row names the columns."""
    yield CSV_HEAD
    for point in curve.points:
        for method, figures in point.figures.items():
            for name, figure in figures.items():
                deviation = "" if figure.deviation is None else f"{figure.deviation:.6g}"
                numbers = (f"{figure.value:.6g}", f"{figure.low:.6g}", f"{figure.high:.6g}", deviation)
                yield "curve", f"{point.seconds:g}", method, "", name, *numbers
    for table, differences in (("step", curve.steps), ("gain", curve.gains)):
        for some in differences:
            minus = f"{some.minus}, {some.minus_seconds:g} s"
            for name, value in some.figures.items():
                numbers = (f"{value.value:.6g}", f"{value.low:.6g}", f"{value.high:.6g}", "")
                yield table, f"{some.seconds:g}", some.method, minus, name, *numbers


def _step_text(difference: CurveDifference) -> str:
    figures = ", ".join(HEADS[name] for name in difference.surely_worse())
    return f"{difference.method} at {difference.seconds:.0f} s ({figures})"


def _estimate_text(estimate: ChoiceEstimate) -> str:
    value = f"{round(estimate.value, 3) + 0.0:.3f}"  # no minus before 0.000
    return value if estimate.deviation is None else f"{value} ± {estimate.deviation:.3f}"
