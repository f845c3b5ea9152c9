"""Results of an evaluation on test people as Markdown tables and as rows for a CSV file."""

from collections.abc import Iterator, Sequence

from corpus_tools.measures.intervals import IntervalEstimate
from corpus_tools.studies.evaluation.people import PeopleEvaluation
from corpus_tools.studies.report import Report, as_csv, as_json, markdown_table

FIGURE_HEADS = (
    ("r_opening", "r opening"), ("r_width", "r width"), ("dtw_cost", "DTW cost"),
    ("r_opening_within", "r opening within"), ("r_width_within", "r width within"),
)  # fmt: skip
CSV_HEAD = ("table", "method", "figure", "value", "low", "high")


def people_table(found: PeopleEvaluation) -> str:
    """Markdown table of the figures with their intervals, one method a line."""
    head = ("method", *(head for _, head in FIGURE_HEADS), "r opening, phones recorded", "not recorded")
    rows = (
        (
            method,
            *(interval_text(figures[name]) for name, _ in FIGURE_HEADS),
            *(_plain_text(value) for value in found.heard[method]),
        )
        for method, figures in found.figures.items()
    )
    return markdown_table([head, *rows])


def difference_table(found: PeopleEvaluation, method: str) -> str:
    """Markdown table of the differences of a method from the others, with paired intervals."""
    rows = (
        (other, *(interval_text(values[name], signed=True) for name, _ in FIGURE_HEADS))
        for (difference, other), values in found.differences.items()
        if difference == method
    )
    return markdown_table([(f"{method} minus", *(head for _, head in FIGURE_HEADS)), *rows])


def phone_table(found: PeopleEvaluation, methods: Sequence[str]) -> str:
    """Markdown table of mean opening and width by phone in z, recorded and of some methods."""
    rows = (
        (
            phone.phone,
            str(phone.n_tokens),
            "yes" if phone.is_heard else "no",
            *(_pair_text(pair) for pair in (phone.real, *(phone.made[method] for method in methods))),
        )
        for phone in found.phones
    )
    return markdown_table([("phone", "tokens", "in the talker", "recorded: opening, width", *methods), *rows])


def people_rows(found: PeopleEvaluation) -> Iterator[tuple[str, ...]]:
    """All figures and differences with their intervals; the first row names the columns."""
    yield CSV_HEAD
    for method, figures in found.figures.items():
        for name, value in figures.items():
            yield "people", method, name, *_interval_cells(value)
    for (difference, other), values in found.differences.items():
        for name, value in values.items():
            yield f"minus {other}", difference, name, *_interval_cells(value)


def interval_text(value: IntervalEstimate, *, signed: bool = False) -> str:
    """A figure with its interval in brackets."""
    sign = "+" if signed else ""
    return f"{value.value:{sign}.3f} ({value.low:{sign}.3f} to {value.high:{sign}.3f})"


def _interval_cells(value: IntervalEstimate) -> tuple[str, str, str]:
    return f"{value.value:.6g}", f"{value.low:.6g}", f"{value.high:.6g}"


def _plain_text(value: float) -> str:
    return "" if value != value else f"{value:.3f}"  # noqa: PLR0124 - NaN


def _pair_text(pair: tuple[float, float]) -> str:
    return f"{pair[0]:+.2f}, {pair[1]:+.2f}"


REPORT: Report[PeopleEvaluation] = Report(
    {".json": as_json(PeopleEvaluation.to_json, is_ascii=True), ".csv": as_csv(people_rows)}
)
