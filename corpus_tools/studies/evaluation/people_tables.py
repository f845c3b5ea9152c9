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
    rows = [("method", *(head for _, head in FIGURE_HEADS), "r opening, phones recorded", "not recorded")]
    for method, figures in found.figures.items():
        cells = (_interval_text(figures[name], signed=False) for name, _ in FIGURE_HEADS)
        rows.append((method, *cells, *(_plain_text(value) for value in found.heard[method])))
    return markdown_table(rows)


def difference_table(found: PeopleEvaluation, method: str) -> str:
    """Markdown table of the differences of a method from the others, with paired intervals."""
    rows = [(f"{method} minus", *(head for _, head in FIGURE_HEADS))]
    for (difference, other), values in found.differences.items():
        if difference == method:
            rows.append((other, *(_interval_text(values[name], signed=True) for name, _ in FIGURE_HEADS)))
    return markdown_table(rows)


def phone_table(found: PeopleEvaluation, methods: Sequence[str]) -> str:
    """Markdown table of mean opening and width by phone in z, recorded and of some methods."""
    rows = [("phone", "tokens", "in the talker", "recorded: opening, width", *methods)]
    for phone in found.phones:
        cells = (_pair_text(phone.made[method]) for method in methods)
        rows.append(
            (phone.phone, str(phone.n_tokens), "yes" if phone.is_heard else "no", _pair_text(phone.real), *cells)
        )
    return markdown_table(rows)


def people_rows(found: PeopleEvaluation) -> Iterator[tuple[str, ...]]:
    """All figures and differences with their intervals; the first row names the columns."""
    yield CSV_HEAD
    for method, figures in found.figures.items():
        for name, value in figures.items():
            yield "people", method, name, *_interval_cells(value)
    for (difference, other), values in found.differences.items():
        for name, value in values.items():
            yield f"minus {other}", difference, name, *_interval_cells(value)


def _interval_text(value: IntervalEstimate, *, signed: bool) -> str:
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
