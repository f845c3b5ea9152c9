"""Files of a study of moods: figures of each mood, all figures, and a contact sheet."""

from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from corpus_tools.studies.gestures.moods import MoodOptions, MoodStudy, study_moods
from corpus_tools.studies.report import Report, Rows, as_csv, as_json
from tts2face.session.session import Session
from tts2face.types import Progress, ignore_progress

# Columns of the tables: scores of the tracker, both sides averaged.
SHOWN_SCORES: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "smile": ("mouthSmileLeft", "mouthSmileRight"),
        "frown": ("mouthFrownLeft", "mouthFrownRight"),
        "eyes narrowed": ("eyeSquintLeft", "eyeSquintRight"),
        "brows down": ("browDownLeft", "browDownRight"),
        "inner brows up": ("browInnerUp",),
        "outer brows up": ("browOuterUpLeft", "browOuterUpRight"),
    }
)
SHEET_CLIPS = 2  # of each mood on the contact sheet


def write_moods(
    session: Session, out: Path, options: MoodOptions, *, on_progress: Progress = ignore_progress
) -> MoodStudy:
    """Study the moods of a session's palette, write the file, and return the study.

    ``.json`` has all figures, ``.csv`` a line for each mood, ``.png`` is a contact sheet.

    Raises
    ------
    InputError
        The suffix is unknown; errors as `study_moods`. Nothing is written then.
    """
    return REPORT.write(out, lambda: study_moods(session, options, on_progress=on_progress))


def mood_rows(study: MoodStudy) -> list[dict[str, Any]]:
    """Figures of each mood: recognised test clips, smile weights, blinks, yaw, and mean scores of the tracker."""
    rows = []
    for number, mood in enumerate(study.moods):
        low, mean, high = study.smile_range(mood)
        row = {
            "mood": mood,
            "recognised": int(study.confusion[number, number]),
            "of": int(study.confusion[number].sum()),
            "smile weight": round(mean, 3),
            "smile weight, 5 %": round(low, 3),
            "smile weight, 95 %": round(high, 3),
            "blinks a minute": round(float(np.mean([clip.blinks_per_minute for clip in study.clips[mood]])), 1),
            "yaw spread, deg": round(float(np.mean([clip.yaw_spread_deg for clip in study.clips[mood]])), 2),
        }
        rows.append(row | {name: round(study.mean_score(mood, *shapes), 3) for name, shapes in SHOWN_SCORES.items()})
    return rows


def _table_rows(study: MoodStudy) -> Rows:
    rows = mood_rows(study)
    return [list(rows[0]), *(list(row.values()) for row in rows)]


def mood_figures(study: MoodStudy) -> dict[str, Any]:
    """All figures."""
    return {
        "seeds": study.options.seeds,
        "first_seed": study.options.first_seed,
        "frames": study.options.frames,
        "size": study.options.size,
        "accuracy": round(study.accuracy, 4),
        "frame_accuracy": round(study.frame_accuracy, 4),
        "confusion": study.confusion.tolist(),
        "frame_confusion": study.frame_confusion.tolist(),
        "moods": mood_rows(study),
    }


def moods_png(study: MoodStudy) -> bytes:
    """Contact sheet with a row of frames for each mood."""
    from PIL import Image, ImageDraw

    rows = [np.concatenate([clip.frames for clip in clips[-SHEET_CLIPS:]]) for clips in study.clips.values()]
    sheet = Image.fromarray(np.concatenate([np.concatenate(list(row), axis=1) for row in rows]))
    pen = ImageDraw.Draw(sheet)
    for number, mood in enumerate(study.moods):
        pen.text((6, 4 + number * rows[0].shape[1]), mood, fill="white")
    file = BytesIO()
    sheet.save(file, "png")
    return file.getvalue()


REPORT: Report[MoodStudy] = Report({".csv": as_csv(_table_rows), ".json": as_json(mood_figures), ".png": moods_png})
