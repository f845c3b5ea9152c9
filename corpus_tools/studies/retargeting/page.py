"""HTML page and plot of a study of retargeting.

Write a study of retargeting as HTML, JSON, CSV or PNG.
"""

import csv
import io
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict
from html import escape
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from corpus_tools.run_options import RunOptions, StageCallback, ignore_stage
from corpus_tools.studies.pages import note_paragraph, page, paragraphs, report_writer, scroll_box, table
from corpus_tools.studies.plots import FIRST, INK, RULE, SECOND, Tip, draw_png, draw_svg
from corpus_tools.studies.retargeting.analysis import (
    LEAST_TOKENS,
    SCORES,
    TOLERANCE,
    PhoneScores,
    RetargetingStudy,
    motion_figures,
    study_retargeting,
)
from corpus_tools.studies.similarity.tables import phone_label
from tts2face.models.face_loading import load_face
from tts2face.storage.files import write_atomically

if TYPE_CHECKING:
    from matplotlib.figure import Figure


WIDTH, ROW, HEAD = 1100, 16, 90  # px: the plot, a phone, title and legend
PLOT_NAME = "scores of the person and of the face by phone"


def retargeting_page(study: RetargetingStudy) -> str:
    """The page (HTML)."""
    judged = [one for one in study.phones if one.is_judged]
    others = [one for one in study.phones if not one.is_judged]
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
        rare = ", ".join(f"{one.phone} {one.n_tokens}" for one in others)
        parts.append(paragraphs(f"Phones with fewer tokens: {rare}."))
    return page(f"Retargeting to {study.face}", parts)


def figure_png(study: RetargetingStudy) -> bytes:
    """The plot as PNG."""
    judged = [one for one in study.phones if one.is_judged] or list(study.phones)
    return draw_png(lambda figure: _draw(figure, judged), WIDTH, HEAD + ROW * len(judged))


def _motion(study: RetargetingStudy) -> str:
    figures = motion_figures(study.motion)
    return table(tuple(figures), [tuple(figures.values())], numbers=range(len(figures)))


def _plot(judged: Sequence[PhoneScores]) -> Iterator[str]:
    if judged:
        height = HEAD + ROW * len(judged)
        yield note_paragraph("Dark: the person. Blue: the face; ochre where the difference exceeds the tolerance.")
        yield scroll_box(draw_svg(lambda figure: _draw(figure, judged), WIDTH, height, PLOT_NAME))


def _draw(figure: "Figure", phones: Sequence[PhoneScores]) -> list[Tip]:
    """A panel for each score, with the person's and the face's mean of each phone on one line."""
    tips = []
    rows = np.arange(len(phones))
    for at, (score, axes) in enumerate(
        zip(SCORES, figure.subplots(1, len(SCORES), sharey=True, squeeze=False)[0], strict=True)
    ):
        person, face = (np.array([getattr(one, who)[at] for one in phones]) for who in ("person", "face"))
        missed = np.abs(face - person) > TOLERANCE
        axes.hlines(rows, person, face, color=RULE, linewidth=2)
        axes.plot(person, rows, "o", color=INK, markersize=4)
        for some, colour in ((~missed, FIRST), (missed, SECOND)):
            axes.plot(face[some], rows[some], "o", color=colour, markersize=4)
        axes.set(title=score, xlim=(-0.04, 1.04), ylim=(len(phones) - 0.5, -0.5), xticks=(0, 0.5, 1))
        axes.set_yticks(rows, [one.phone for one in phones])
        tips += [
            Tip(axes, -0.04, row - 0.5, f"{one.phone}: {own:.2f} -> {shown:.2f}", 1.08, 1.0)
            for row, one, own, shown in zip(rows, phones, person, face, strict=True)
        ]
    return tips


def _score_table(score: str, at: int, judged: Sequence[PhoneScores]) -> str:
    rows = [(one.phone, str(one.n_tokens), *_numbers(float(one.person[at]), float(one.face[at]))) for one in judged]
    head = ("phone", "tokens", "person", "face", "difference", "")
    return f"<h3>{escape(score)}</h3>\n{table(head, rows, numbers=range(1, 5))}"


def _numbers(person: float, face: float) -> tuple[str, ...]:
    missed = "beyond the tolerance" if abs(face - person) > TOLERANCE else ""
    return f"{person:.2f}", f"{face:.2f}", f"{face - person:+.2f}", missed


def write_retargeting(
    recordings: Path,
    out: Path,
    *,
    face: str = "head",
    identity: str | None = None,
    run_options: RunOptions | None = None,
    stages: StageCallback = ignore_stage,
) -> RetargetingStudy:
    """Study the retargeting of recordings to a face (by name or path), write the file, and return the study.

    ``.html`` is a page, ``.json`` and ``.csv`` have the scores of every phone, ``.png`` the plot.

    Raises
    ------
    InputError
        The suffix is unknown; errors as `load_face` and `study_retargeting`. Nothing is written then.
    BackendError
        matplotlib, the tracker or its models are missing, or the file cannot be written.
    """
    writer = report_writer(out, WRITERS)
    name = face if identity is None else f"{face}, {identity}"
    study = study_retargeting(recordings, load_face(face, identity), name=name, run_options=run_options, stages=stages)
    write_atomically(out, writer(study))
    return study


def study_csv(study: RetargetingStudy) -> str:
    """Table with a line for each phone and score."""
    file = io.StringIO()
    rows = csv.writer(file, lineterminator="\n")
    rows.writerow(["phone", "arpabet", "tokens", "score", "person", "face", "difference"])
    for one in study.phones:
        for score, person, face in zip(SCORES, one.person, one.face, strict=True):
            numbers = (f"{value:.4f}" for value in (person, face, face - person))
            rows.writerow([one.phone, phone_label(one.phone, "arpabet"), one.n_tokens, score, *numbers])
    return file.getvalue()


def study_json(study: RetargetingStudy) -> str:
    """All figures as JSON."""
    phones = [
        {
            "phone": one.phone,
            "tokens": one.n_tokens,
            "person": dict(zip(SCORES, np.round(one.person, 4).tolist(), strict=True)),
            "face": dict(zip(SCORES, np.round(one.face, 4).tolist(), strict=True)),
        }
        for one in study.phones
    ]
    motion = {name: None if value != value else value for name, value in asdict(study.motion).items()}  # noqa: PLR0124
    content = {
        "face": study.face,
        "recordings": study.n_recordings,
        "frames": study.n_frames,
        "tolerance": TOLERANCE,
        "judged": int(study.differences.size),
        "missed": study.n_missed,
        "motion": motion,
        "phones": phones,
    }
    return json.dumps(content, ensure_ascii=False, indent=1) + "\n"


WRITERS: Mapping[str, Callable[[RetargetingStudy], bytes]] = MappingProxyType(
    {
        ".html": lambda study: retargeting_page(study).encode(),
        ".csv": lambda study: study_csv(study).encode(),
        ".json": lambda study: study_json(study).encode(),
        ".png": figure_png,
    }
)
