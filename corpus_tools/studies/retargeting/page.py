"""HTML page and plot of a study of retargeting."""

from collections.abc import Iterator, Sequence
from html import escape
from typing import TYPE_CHECKING

import numpy as np

from corpus_tools.studies.pages import note_paragraph, page, paragraphs, scroll_box, table
from corpus_tools.studies.plots import FIRST, INK, RULE, SECOND, Plot, Tip
from corpus_tools.studies.retargeting.analysis import (
    LEAST_TOKENS,
    SCORES,
    TOLERANCE,
    PhoneScores,
    RetargetingStudy,
    motion_figures,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure


WIDTH, ROW, HEAD = 1100, 16, 90  # px: the plot, a phone, title and legend
PLOT_NAME = "scores of the person and of the face by phone"


def retargeting_page(study: RetargetingStudy) -> str:
    """The page (HTML)."""
    judged = [phone for phone in study.phones if phone.is_judged]
    others = [phone for phone in study.phones if not phone.is_judged]
    parts = [
        paragraphs(
            f"{study.n_recordings} recordings, {study.n_frames} frames; the face {study.face} mimics every frame.",
            f"{study.n_missed} of {study.differences.size} differences exceed {TOLERANCE} (phones with {LEAST_TOKENS} "
            "tokens or more).",
        ),
        note_paragraph(
            "Scores of the face tracker, 0 to 1, in the recordings and in pictures of the face: means at the middle of "
            "each phone, left and right averaged."
        ),
        "<h2>Motion of the mouth</h2>",
        _motion(study),
        "<h2>Scores by phone</h2>",
        *_plot(judged),
        *(_score_table(score, at, judged) for at, score in enumerate(SCORES)),
    ]
    if others:
        rare = ", ".join(f"{other.phone} {other.n_tokens}" for other in others)
        parts.append(paragraphs(f"Phones with fewer tokens: {rare}."))
    return page(f"Retargeting to {study.face}", parts)


def score_plot(phones: Sequence[PhoneScores]) -> Plot:
    """The scores of the person and of the face."""
    return Plot(lambda figure: _draw(figure, phones), WIDTH, HEAD + ROW * len(phones), PLOT_NAME)


def study_plot(study: RetargetingStudy) -> Plot:
    """The scores of the judged phones, or of all if none is."""
    return score_plot([scores for scores in study.phones if scores.is_judged] or study.phones)


def _motion(study: RetargetingStudy) -> str:
    figures = motion_figures(study.motion)
    return table(tuple(figures), [tuple(figures.values())], numbers=range(len(figures)))


def _plot(judged: Sequence[PhoneScores]) -> Iterator[str]:
    if judged:
        yield note_paragraph("Dark: the person. Blue: the face; ochre where the difference exceeds the tolerance.")
        yield scroll_box(score_plot(judged).svg())


def _draw(figure: "Figure", phones: Sequence[PhoneScores]) -> list[Tip]:
    """A panel for each score, with the person's and the face's mean of each phone on one line."""
    tips = []
    rows = np.arange(len(phones))
    for at, (score, axes) in enumerate(
        zip(SCORES, figure.subplots(1, len(SCORES), sharey=True, squeeze=False)[0], strict=True)
    ):
        person, face = (np.array([getattr(phone, who)[at] for phone in phones]) for who in ("person", "face"))
        missed = np.abs(face - person) > TOLERANCE
        axes.hlines(rows, person, face, color=RULE, linewidth=2)
        axes.plot(person, rows, "o", color=INK, markersize=4)
        for some, colour in ((~missed, FIRST), (missed, SECOND)):
            axes.plot(face[some], rows[some], "o", color=colour, markersize=4)
        axes.set(title=score, xlim=(-0.04, 1.04), ylim=(len(phones) - 0.5, -0.5), xticks=(0, 0.5, 1))
        axes.set_yticks(rows, [phone.phone for phone in phones])
        tips += [
            Tip(axes, -0.04, row - 0.5, f"{phone.phone}: {own:.2f} -> {shown:.2f}", 1.08, 1.0)
            for row, phone, own, shown in zip(rows, phones, person, face, strict=True)
        ]
    return tips


def _score_table(score: str, at: int, judged: Sequence[PhoneScores]) -> str:
    rows = [
        (scores.phone, str(scores.n_tokens), *_numbers(float(scores.person[at]), float(scores.face[at])))
        for scores in judged
    ]
    head = ("phone", "tokens", "person", "face", "difference", "")
    return f"<h3>{escape(score)}</h3>\n{table(head, rows, numbers=range(1, 5))}"


def _numbers(person: float, face: float) -> tuple[str, ...]:
    missed = "beyond the tolerance" if abs(face - person) > TOLERANCE else ""
    return f"{person:.2f}", f"{face:.2f}", f"{face - person:+.2f}", missed
