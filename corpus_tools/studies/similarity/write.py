"""The analysis of a talker as a page, a matrix, all figures and a heat map, and their files."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from corpus_tools.studies.plots import Plot
from corpus_tools.studies.report import Report, Rows, as_csv, as_html, as_json, as_png, csv_text
from corpus_tools.studies.similarity.analysis import Analysis, NamedTalker, SimilarityOptions, TableComparison, analyse
from corpus_tools.studies.similarity.consistency import Consistency
from corpus_tools.studies.similarity.figures import difference_figure, similarity_figure, table_plot
from corpus_tools.studies.similarity.mantel import Agreement
from corpus_tools.studies.similarity.page import similarity_page
from corpus_tools.studies.similarity.reliability import Reliability
from corpus_tools.studies.similarity.tables import (
    LEAST_TOKENS,
    SimilarityTable,
    VisemeClasses,
    check_labels,
    phone_label,
)
from lexicon.phones import look_up_phone
from tts2face.models.talker_file import load_talker
from tts2face.types import Progress, ignore_progress


def table_csv(table: SimilarityTable, labels: str) -> str:
    """One line for each phone: its label, its tokens, its similarity to each phone."""
    return csv_text(_table_rows(table, labels))


def _table_rows(table: SimilarityTable, labels: str) -> Rows:
    names = [phone_label(phone, labels) for phone in table.phones]
    yield ["phone", "tokens", *names]
    for name, count, row in zip(names, table.counts, table.matrix, strict=True):
        yield [name, str(count), *(f"{value:.4f}" for value in row)]


def _difference_rows(compared: TableComparison, labels: str) -> Rows:
    """Similarity to each phone on the first talker minus that on the other, one line for each phone."""
    names = [phone_label(phone, labels) for phone in compared.phones]
    yield ["phone", *names]
    for name, row in zip(names, compared.difference, strict=True):
        yield [name, *(f"{value:.4f}" for value in row)]


def analysis_figures(analysis: Analysis) -> dict[str, Any]:
    """All figures; similarities in the order of ``phones``."""
    return {
        "talker": analysis.name,
        "utterances": analysis.n_utterances,
        "seed": analysis.options.seed,
        "phones": [{"ipa": phone, "arpabet": look_up_phone(phone).arpabet or None} for phone in analysis.table.phones],
        "tokens": analysis.table.counts.tolist(),
        "similarity": _round_values(analysis.table.matrix),
        "similarity_to_silence": _round_values(analysis.table.silence),
        "neighbours": {
            phone: [{"phone": near, "similarity": round(value, 4)} for near, value in ranked]
            for phone, ranked in zip(analysis.table.phones, analysis.neighbours, strict=True)
        },
        "dendrogram": {
            "order": [analysis.table.phones[at] for at in analysis.tree.order],
            "links": _round_values(analysis.tree.links),
        },
        "classes": {
            "best": analysis.best.n_classes,
            "chosen": [_classes(analysis, classes) for classes in analysis.chosen],
            "silhouettes": {str(classes.n_classes): round(classes.silhouette, 4) for classes in analysis.curve},
            "best_classes": _classes(analysis, analysis.best),
        },
        "reliability": {
            "least_tokens": LEAST_TOKENS,
            "utterances": _reliability(analysis.by_utterances),
            "words": _reliability(analysis.by_words),
            "utterances_phones_of_words": _reliability(analysis.by_utterances_same_phones),
        },
        "articulation": {
            "agreement": {name: _agreement(agreement) for name, agreement in analysis.articulatory},
            "distance": _round_values(analysis.articulation),
        },
        "movements": _consistency(analysis, analysis.movements),
        "modes": _consistency(analysis, analysis.modes),
        "comparison": None if analysis.comparison is None else _comparison(analysis.comparison),
    }


def _round_values(values: NDArray[np.floating]) -> Any:
    """Lists with four decimals, None for NaN."""
    if values.ndim > 1:
        return [_round_values(row) for row in values]
    # JSON has no NaN
    return [round(float(value), 4) if np.isfinite(value) else None for value in values]


def _classes(analysis: Analysis, classes: VisemeClasses) -> dict[str, Any]:
    groups = [
        [analysis.table.phones[at] for at in analysis.tree.order if classes.labels[at] == number]
        for number in range(classes.n_classes)
    ]
    silhouettes = dict(zip(analysis.table.phones, _round_values(classes.silhouettes), strict=True))
    return {
        "n": classes.n_classes,
        "silhouette": round(classes.silhouette, 4),
        "classes": groups,
        "silhouettes": silhouettes,
    }


def _reliability(split: Reliability | None) -> dict[str, Any] | None:
    if split is None:
        return None
    return {
        "mean": round(split.mean, 4),
        "spearman_brown": round(split.full_length_reliability, 4),
        "halves": _round_values(split.correlations),
        "halves_requested": split.n_requested,
        "phones_compared": split.n_phones.tolist(),
        "phones": dict(zip(split.phones, _round_values(split.per_phone), strict=True)),
        "left_out": list(split.left_out),
    }


def _agreement(agreement: Agreement) -> dict[str, Any]:
    return {
        "r": round(agreement.r, 4),
        "p": agreement.p,
        "permutations": agreement.n_permutations,
        "pairs": agreement.n_pairs,
    }


def _consistency(analysis: Analysis, consistency: Consistency) -> dict[str, Any]:
    return {
        "names": list(consistency.names),
        "spread_mm": _round_values(consistency.spread),
        "free_share": _round_values(consistency.free_share),
        "free": dict(zip(analysis.table.phones, _round_values(consistency.free), strict=True)),
    }


def _comparison(compared: TableComparison) -> dict[str, Any]:
    return {
        "other": compared.other,
        "phones": list(compared.phones),
        "left_out": list(compared.left_out),
        "agreement": _agreement(compared.agreement),
        "difference": _round_values(compared.difference),
        "mean_difference": dict(zip(compared.phones, _round_values(compared.per_phone), strict=True)),
    }


def write_similarity(
    talker: str,
    out: Path,
    options: SimilarityOptions,
    *,
    other: str | None = None,
    labels: str = "both",
    on_progress: Progress = ignore_progress,
) -> Analysis:
    """Analyse a talker (by name or path), write the file, and return the analysis.

    ``.html`` is a page, ``.json`` has every figure, ``.csv`` the matrix, ``.png`` the heat map; with `other` the last
    two hold the difference of the two talkers.

    Raises
    ------
    InputError
        The suffix or the labels are unknown; errors as `load_talker` and `analyse`. Nothing is written then.
    BackendError
        matplotlib or scikit-learn is not installed, or the file cannot be written.
    """

    def measure() -> Analysis:
        check_labels(labels)
        against = None if other is None else NamedTalker(other, load_talker(other))
        return analyse(NamedTalker(talker, load_talker(talker)), options, against, on_progress)

    return similarity_report(labels).write(out, measure)


def similarity_report(labels: str) -> Report[Analysis]:
    """The files of an analysis with phones labelled in ``ipa``, ``arpabet`` or ``both``.

    With another talker the table and the picture are the difference of the two.
    """

    def rows(found: Analysis) -> Rows:
        return _difference_rows(other, labels) if (other := found.comparison) else _table_rows(found.table, labels)

    def heat_map(found: Analysis) -> Plot:
        other = found.comparison
        return table_plot(difference_figure(found, other, labels) if other else similarity_figure(found, labels))

    return Report(
        {
            ".html": as_html(lambda found: similarity_page(found, labels)),
            ".csv": as_csv(rows),
            ".json": as_json(analysis_figures),
            ".png": as_png(heat_map),
        }
    )
