"""Write a study of retargeting as HTML, JSON, CSV or PNG."""

import csv
import io
import json
from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path
from types import MappingProxyType

import numpy as np

from corpus_tools.report.page import report_writer
from corpus_tools.retargeting_study.analysis import SCORES, TOLERANCE, RetargetingStudy, study_retargeting
from corpus_tools.retargeting_study.page import figure_png, retargeting_page
from corpus_tools.run_options import RunOptions, StageCallback, ignore_stage
from corpus_tools.similarity.tokens import phone_label
from tts2face.models.face_loading import load_face
from tts2face.storage.files import write_atomically


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
