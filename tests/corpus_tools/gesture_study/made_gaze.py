"""Recordings of gaze that are made by the process, in the form of those of people."""

import gzip
from pathlib import Path

import numpy as np

from corpus_tools.studies.gestures.gaze import made_person
from corpus_tools.training.gaze_recordings import CONDITIONS, PX_PER_DEG
from tts2face.models.gaze import load_gaze

FACE_PX = np.array([900.0, 1100.0])  # y, x
COLUMNS = ("condition", "passage", "segment", "start", "duration", "x", "y")


def write_people(folder: Path, n_people: int = 2) -> Path:
    """A folder with tables of people, who speak and listen for ten minutes each."""
    passages = ["person\tpassage\tface_x\tface_y"]
    for person in range(1, n_people + 1):
        rows = ["\t".join(COLUMNS)]
        for passage, (state, condition) in enumerate(CONDITIONS.items()):
            passages.append(f"{person}\t{passage}\t{FACE_PX[1]}\t{FACE_PX[0]}")
            made = made_person(load_gaze(), state, person)
            places = FACE_PX + made.place * [1.0, -1.0] * PX_PER_DEG
            for start, duration, (y, x) in zip(made.start, made.duration, places, strict=True):
                rows.append(f"{condition}\t{passage}\t0\t{start:.4f}\t{duration:.4f}\t{x:.3f}\t{y:.3f}")
        (folder / f"person{person:02d}.tsv.gz").write_bytes(gzip.compress("\n".join(rows).encode()))
    (folder / "passages.tsv").write_text("\n".join(passages), encoding="utf-8")
    return folder
