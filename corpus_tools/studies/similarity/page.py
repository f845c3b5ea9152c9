"""HTML page of a similarity analysis."""

from collections.abc import Sequence
from html import escape

import numpy as np

from corpus_tools.studies.pages import note_paragraph, page, paragraphs, scroll_box, table
from corpus_tools.studies.similarity.analysis import Analysis, TableComparison
from corpus_tools.studies.similarity.figures import (
    articulation_svg,
    difference_figure,
    freedom_svg,
    shares_svg,
    silhouettes_svg,
    similarity_figure,
    table_plot,
)
from corpus_tools.studies.similarity.mantel import N_PERMUTATIONS
from corpus_tools.studies.similarity.reliability import Reliability
from corpus_tools.studies.similarity.tables import LEAST_TOKENS, VisemeClasses, phone_label

N_DIFFERENT = 10


def similarity_page(analysis: Analysis, labels: str) -> str:
    """The page (HTML), phones labelled in ``ipa``, ``arpabet`` or ``both``."""
    parts = [
        _summary(analysis),
        "<h2>Phone by phone</h2>",
        note_paragraph("Without silence. Hover over a cell for its value."),
        scroll_box(table_plot(similarity_figure(analysis, labels)).svg()),
        "<h2>Most similar phones</h2>",
        note_paragraph(
            "Table 1 of Theobald et al. 2007. Agreement: correlation of a phone's similarities between random halves."
        ),
        _neighbours(analysis, labels),
        "<h2>Viseme classes</h2>",
        *_classes(analysis, labels),
        "<h2>Reliability</h2>",
        *_reliability(analysis, labels),
        "<h2>Similarity and articulation</h2>",
        *_articulation(analysis, labels),
        "<h2>Movements that phones constrain</h2>",
        *_consistency(analysis, labels),
    ]
    if analysis.comparison is not None:
        parts += [f"<h2>Compared with {escape(analysis.comparison.other)}</h2>", *_comparison(analysis, labels)]
    return page(f"Similarity of phones: {analysis.name}", parts)


def _summary(analysis: Analysis) -> str:
    n_tokens = int(analysis.table.counts.sum())
    agree, words = analysis.by_utterances, analysis.by_words
    other_words = "" if words is None else f"; halves of the vocabulary by {words.mean:.3f}"
    return paragraphs(
        f"{len(analysis.table.phones)} phones, {n_tokens} tokens, {analysis.n_utterances} utterances.",
        f"Best number of viseme classes: {analysis.best.n_classes} (silhouette {analysis.best.silhouette:.2f}).",
        f"Reliability: halves of the utterances correlate by {agree.mean:.3f}{other_words}.",
        f"Articulatory features: r = {analysis.articulatory[0][1].r:.2f}, p = {analysis.articulatory[0][1].p:.4f}.",
    )


def _neighbours(analysis: Analysis, labels: str) -> str:
    rows = [
        (
            phone_label(phone, labels),
            str(count),
            *(f"{phone_label(near, labels)} {value:.3f}" for near, value in ranked),
            f"{silence:.2f}",
            f"{agreement:.2f}" if np.isfinite(agreement) else f"under {LEAST_TOKENS} tokens per half",
        )
        for phone, count, ranked, silence, agreement in zip(
            analysis.table.phones,
            analysis.table.counts,
            analysis.neighbours,
            analysis.table.silence,
            analysis.by_utterances.per_phone,
            strict=True,
        )
    ]
    ranks = [f"rank {place}" for place in range(1, len(analysis.neighbours[0]) + 1)]
    last = 2 + len(ranks)
    return table(("phone", "tokens", *ranks, "to silence", "agreement"), rows, numbers=(1, last, last + 1))


def _classes(analysis: Analysis, labels: str) -> list[str]:
    shown = {classes.n_classes: classes for classes in (analysis.best, *analysis.chosen)}
    rows = [
        (
            f"{n} (best)" if n == analysis.best.n_classes else str(n),
            f"{classes.silhouette:.3f}",
            class_members(analysis, classes, labels),
        )
        for n, classes in sorted(shown.items())
    ]
    return [
        note_paragraph(
            "Average linkage on 1 - similarity, cut into the given number of classes. A phone's silhouette is near 1 "
            "if it is similar to its own class and dissimilar to the nearest other; 0 for a single phone."
        ),
        silhouettes_svg(analysis),
        table(("classes", "silhouette", "phones"), rows, numbers=(1,)),
    ]


def class_members(analysis: Analysis, classes: VisemeClasses, labels: str) -> str:
    """The phones of each class, in the dendrogram's order."""
    grouped: list[list[str]] = [[] for _ in range(classes.n_classes)]
    for at in analysis.tree.order:
        unbroken = phone_label(analysis.table.phones[at], labels).replace(" ", "\N{NO-BREAK SPACE}")
        grouped[classes.labels[at]].append(unbroken)
    return "  |  ".join((", " if labels == "both" else " ").join(group) for group in grouped)


def _reliability(analysis: Analysis, labels: str) -> list[str]:
    splits: list[tuple[str, Reliability | None]] = [
        ("utterances", analysis.by_utterances),
        ("words", analysis.by_words),
        ("utterances, phones of the words", analysis.by_utterances_same_phones),
    ]
    rows = [_reliability_row(name, split) for name, split in splits]
    left = [
        f"Not compared between halves of {name}, with fewer than {LEAST_TOKENS} tokens in a half: "
        f"{', '.join(phone_label(phone, labels) for phone in split.left_out)}."
        for name, split in splits
        if split is not None and split.left_out and split is not analysis.by_utterances_same_phones
    ]
    head = ("halves of", "halves", "phones", "correlation", "lowest", "highest", "whole (Spearman-Brown)")
    return [
        note_paragraph(
            f"The corpus is split in two at random, {analysis.options.halves} times; a table is computed from each "
            "half, and the two are correlated over the pairs of phones. Halves of the utterances contain the same "
            "words: they measure the effect of more recordings of the same kind. Halves of the words have no word in "
            "common: they measure the effect of other words."
        ),
        table(head, rows, numbers=range(1, 7)),
        paragraphs(*left),
    ]


def _reliability_row(name: str, split: Reliability | None) -> Sequence[str]:
    if split is None:
        return (name, "0", "too few phones with tokens in both halves", "", "", "", "")
    r = split.correlations
    few, many = int(split.n_phones.min()), int(split.n_phones.max())
    figures = (f"{value:.3f}" for value in (split.mean, r.min(), r.max(), split.full_length_reliability))
    return (name, str(len(r)), str(few) if few == many else f"{few} to {many}", *figures)


def _articulation(analysis: Analysis, labels: str) -> list[str]:
    agreements = [
        (name, str(agreement.n_pairs), f"{agreement.r:.3f}", f"{agreement.p:.4f}")
        for name, agreement in analysis.articulatory
    ]
    return [
        note_paragraph(
            "Mantel test: correlation r of the similarity distances with articulatory distances, and the "
            f"share p of {N_PERMUTATIONS} permutations with at least this r."
        ),
        table(("phones", "pairs", "r", "p"), agreements, numbers=(1, 2, 3)),
        note_paragraph("One mark for each pair of phones; hover over it for their names."),
        articulation_svg(analysis, labels),
    ]


def _consistency(analysis: Analysis, labels: str) -> list[str]:
    movements, modes = analysis.movements, analysis.modes
    order = analysis.tree.order
    names = [phone_label(analysis.table.phones[at], labels) for at in order]
    rows = [
        (str(number), name, f"{spread:.2f}", f"{share:.2f}")
        for number, (name, spread, share) in enumerate(zip(modes.names, modes.spread, modes.free_share, strict=True))
    ]
    return [
        note_paragraph(
            "Share of each movement's variance that the phones do not explain, that is, of context and noise. "
            "0: constant within each phone; 1: independent of the phone."
        ),
        shares_svg(movements.names, movements.free_share),
        note_paragraph(
            "By phone: standard deviation within the phone relative to all speech. Blue: constrained in any "
            "context; yellow: at least as variable as all speech. Phones in few words appear constrained because their "
            "context is always the same."
        ),
        scroll_box(freedom_svg(names, movements.names, movements.free[order])),
        note_paragraph(
            "The talker's shape parameters, named by their movement at one standard deviation (mm), with their "
            "standard deviation (mm over all landmarks) and the share that the phones do not explain:"
        ),
        table(("mode", "movement", "spread", "share"), rows, numbers=(0, 2, 3)),
    ]


def _comparison(analysis: Analysis, labels: str) -> list[str]:
    compared = analysis.comparison
    if compared is None:
        return []
    agreement = compared.agreement
    apart = ", ".join(phone_label(phone, labels) for phone in compared.left_out) or "none"
    order = np.argsort(-compared.per_phone, kind="stable")[:N_DIFFERENT]
    phones = [(phone_label(compared.phones[at], labels), f"{compared.per_phone[at]:.3f}") for at in order]
    return [
        paragraphs(
            f"{len(compared.phones)} phones in common; phones of one talker only: {apart}.",
            f"The tables correlate by r = {agreement.r:.3f} over {agreement.n_pairs} pairs; p = {agreement.p:.4f} "
            f"by {agreement.n_permutations} permutations, one-sided.",
        ),
        note_paragraph(
            f"Similarity on {analysis.name} minus that on {compared.other}: orange where it is higher on "
            f"{analysis.name}."
        ),
        scroll_box(table_plot(difference_figure(analysis, compared, labels)).svg()),
        "<h2>Phones and pairs with the largest differences</h2>",
        table(("phone", "mean difference"), phones, numbers=(1,)),
        note_paragraph("Pairs with signed differences:"),
        _pairs(compared, labels),
    ]


def _pairs(compared: TableComparison, labels: str) -> str:
    pairs = compared.largest_differences(N_DIFFERENT)
    rows = [(f"{phone_label(a, labels)} – {phone_label(b, labels)}", f"{value:+.3f}") for a, b, value in pairs]
    return table(("pair", "difference"), rows, numbers=(1,))
