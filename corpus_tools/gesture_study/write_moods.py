"""Files of a study of moods: figures as .csv and .json, a contact sheet as .png."""

import csv
import json
from collections.abc import Callable, Mapping
from io import BytesIO, StringIO
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from corpus_tools.gesture_study.moods import MoodOptions, MoodStudy, study_moods
from corpus_tools.report.page import report_writer
from tts2face.session import Session
from tts2face.storage.files import write_atomically
from tts2face.types import Progress

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


def write_moods(session: Session, out: Path, options: MoodOptions, *, on_progress: Progress | None = None) -> MoodStudy:
    """Study the moods of a session's palette, write the file, and return the study.

    ``.json`` has all figures, ``.csv`` a line for each mood, ``.png`` is a contact sheet.

    Raises
    ------
    InputError
        The suffix is unknown; errors as `study_moods`. Nothing is written then.
    """
    writer = report_writer(out, WRITERS)
    study = study_moods(session, options, on_progress=on_progress)
    write_atomically(out, writer(study))
    return study


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


def moods_csv(study: MoodStudy) -> str:
    """A line for each mood."""
    file, rows = StringIO(), mood_rows(study)
    writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return file.getvalue()


def moods_json(study: MoodStudy) -> str:
    """All figures."""
    content = {
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
    return json.dumps(content, indent=1) + "\n"


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


WRITERS: Mapping[str, Callable[[MoodStudy], bytes]] = MappingProxyType(
    {
        ".csv": lambda study: moods_csv(study).encode(),
        ".json": lambda study: moods_json(study).encode(),
        ".png": moods_png,
    }
)
