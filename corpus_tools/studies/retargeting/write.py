"""The study of retargeting as a page, a table, all figures and a plot, and their files."""

from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from corpus_tools.run_options import RunOptions
from corpus_tools.studies.report import Report, Rows, as_csv, as_html, as_json, as_png
from corpus_tools.studies.retargeting.analysis import SCORES, TOLERANCE, RetargetingStudy, study_retargeting
from corpus_tools.studies.retargeting.page import retargeting_page, study_plot
from corpus_tools.studies.similarity.tables import phone_label
from tts2face.models.face_loading import load_face
from tts2face.types import StageCallback, ignore_stage


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
    name = face if identity is None else f"{face}, {identity}"
    return REPORT.write(
        out,
        lambda: study_retargeting(
            recordings, load_face(face, identity), name=name, run_options=run_options, stages=stages
        ),
    )


def score_rows(study: RetargetingStudy) -> Rows:
    """A line for each phone and score."""
    yield ["phone", "arpabet", "tokens", "score", "person", "face", "difference"]
    for spoken in study.phones:
        for score, person, face in zip(SCORES, spoken.person, spoken.face, strict=True):
            numbers = (f"{value:.4f}" for value in (person, face, face - person))
            yield [spoken.phone, phone_label(spoken.phone, "arpabet"), spoken.n_tokens, score, *numbers]


def study_figures(study: RetargetingStudy) -> dict[str, Any]:
    """All figures."""
    phones = [
        {
            "phone": phone.phone,
            "tokens": phone.n_tokens,
            "person": dict(zip(SCORES, np.round(phone.person, 4).tolist(), strict=True)),
            "face": dict(zip(SCORES, np.round(phone.face, 4).tolist(), strict=True)),
        }
        for phone in study.phones
    ]
    motion = {name: None if value != value else value for name, value in asdict(study.motion).items()}  # noqa: PLR0124
    return {
        "face": study.face,
        "recordings": study.n_recordings,
        "frames": study.n_frames,
        "tolerance": TOLERANCE,
        "judged": int(study.differences.size),
        "missed": study.n_missed,
        "motion": motion,
        "phones": phones,
    }


REPORT: Report[RetargetingStudy] = Report(
    {
        ".html": as_html(retargeting_page),
        ".csv": as_csv(score_rows),
        ".json": as_json(study_figures),
        ".png": as_png(study_plot),
    }
)
