"""Results of an evaluation as tables for the terminal and for files."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from corpus_tools.measures.scores import FIGURES, Scores, available_figures
from corpus_tools.studies.report import markdown_table

TRUE_DURATIONS, OWN_DURATIONS, OTHER_TALKER = "true durations", "own durations", "another talker"
AS_TRACKED = "true durations, recorded face not corrected for head pose"


@dataclass(frozen=True, slots=True)
class Fold:
    """One of several splits: numbers of training and held-out utterances, and scores by method and name."""

    n_train: int
    n_test: int
    figures: Mapping[str, Mapping[str, float]]


@dataclass(frozen=True, slots=True)
class Evaluation:
    """Scores of all methods on held-out utterances.

    ``as_tracked`` are the scores against recorded faces whose landmarks are not corrected for the head's pose; ``own``
    those with a voice's own durations, empty without a voice; ``folds`` those of each split if there are several. If
    the evaluation ``is_across`` talkers, all scores use z-scored curves. ``warnings`` are about names that occur in
    both parts.
    """

    n_train: int
    n_test: int
    scores: tuple[Scores, ...]
    as_tracked: tuple[Scores, ...] = ()
    own: tuple[Scores, ...] = ()
    folds: tuple[Fold, ...] = ()
    is_across: bool = False
    warnings: tuple[str, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """Dictionary for JSON, including utterances."""
        return asdict(self)

    def tables(self) -> Iterator[tuple[str, tuple[Scores, ...]]]:
        """The available tables, by name."""
        yield OTHER_TALKER if self.is_across else TRUE_DURATIONS, self.scores
        if self.as_tracked:
            yield AS_TRACKED, self.as_tracked
        if self.own:
            yield OWN_DURATIONS, self.own

    def table(self) -> str:
        """Markdown tables, one method a line."""
        every = [(name, markdown_table(figure_rows(scores))) for name, scores in self.tables()]
        if self.folds:
            every.append((f"spread over {len(self.folds)} folds", self.fold_table()))
        return every[0][1] if len(every) == 1 else "\n\n".join(f"{name}\n\n{lines}" for name, lines in every)

    def class_table(self) -> str:
        """Markdown table of the classes of phones, one method and class a line."""
        return markdown_table(class_rows(self.scores))

    def fold_table(self) -> str:
        """Markdown table of the standard deviation of each figure over the folds, one method a line."""
        heads = available_figures(self.scores)
        rows = [("method", *(head for _, head, _ in heads))]
        for score in self.scores:
            spreads = (self.fold_mean_and_deviation(score.method, name)[1] for name, _, _ in heads)
            cells = (f"{spread:.{digits}f}" for spread, (_, _, digits) in zip(spreads, heads, strict=True))
            rows.append((score.method, *cells))
        return markdown_table(rows)

    def fold_mean_and_deviation(self, method: str, figure: str) -> tuple[float, float]:
        """Mean and standard deviation (of a sample) of a figure over the folds."""
        values = [fold.figures[method][figure] for fold in self.folds]
        return float(np.mean(values)), float(np.std(values, ddof=1))

    def rows(self) -> tuple[tuple[str, ...], ...]:
        """All figures with their intervals, for a CSV file; the first row names the columns.

        Cells are empty for values that a table lacks and for the intervals of folds.
        """
        head = ("table", "method", *(part for name, _, _ in FIGURES for part in (name, f"{name}_low", f"{name}_high")))
        rows = [(name, score.method, *_interval_cells(score)) for name, scores in self.tables() for score in scores]
        for number, fold in enumerate(self.folds, start=1):
            rows += [(f"fold {number}", name, *_value_cells(values)) for name, values in fold.figures.items()]
        return (head, *rows)


def figure_rows(scores: Sequence[Scores], *, intervals: bool = False) -> list[tuple[str, ...]]:
    """Heads of a table of figures, and a row for each method."""
    heads = available_figures(scores)
    return [
        ("method", *(head for _, head, _ in heads)),
        *(
            (score.method, *(figure_text(score, name, digits, intervals=intervals) for name, _, digits in heads))
            for score in scores
        ),
    ]


def class_rows(scores: Sequence[Scores]) -> list[tuple[str, ...]]:
    """Heads of a table of the classes of phones, and a row for each method and class."""
    rows: list[tuple[str, ...]] = [("method", "phones", "frames", "RMSE z", "opening error", "opening bias")]
    for score in scores:
        for some in score.classes:
            error, bias = f"{some.opening_error:.4f}", f"{some.opening_bias:+.4f}"
            rows.append((score.method, some.phones, str(some.n_frames), f"{some.rmse_z:.3f}", error, bias))
    return rows


def figure_text(scores: Scores, name: str, digits: int, *, intervals: bool) -> str:
    """A figure, with its interval in brackets."""
    figure = scores.figures[name]
    text = f"{figure.value:.{digits}f}"
    return f"{text} ({figure.low:.{digits}f}-{figure.high:.{digits}f})" if intervals else text


def _interval_cells(scores: Scores) -> Iterator[str]:
    for name, _, _ in FIGURES:
        figure = scores.figures.get(name)
        values = (figure.value, figure.low, figure.high) if figure else ()
        yield from (f"{x:.6g}" for x in values) if values else ("", "", "")


def _value_cells(values: Mapping[str, float]) -> Iterator[str]:
    for name, _, _ in FIGURES:
        yield from (f"{values[name]:.6g}" if name in values else "", "", "")
