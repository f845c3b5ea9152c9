"""Recordings of one person for a learning curve: videos, or folders of landmark tracks."""

from pathlib import Path

import numpy as np

from corpus_tools.recordings.observation import TRACK_SUFFIX, Observation
from corpus_tools.recordings.observe import check_any_kept, observe
from corpus_tools.run_options import RunOptions
from corpus_tools.studies.evaluation.lip_observations import lip_observations
from corpus_tools.studies.evaluation.person_tracks import read_person
from corpus_tools.training.pooling.lip_tracks import read_lip_tracks
from corpus_tools.training.pooling.speech import align_lip_tracks
from lexicon.errors import DataError, InputError
from tts2face.models.talker import Talker
from tts2face.types import StageCallback, ignore_stage

LIP_POINTS = "points"  # array that lip tracks hold and tracks of people do not


def read_material(
    folder: Path, base: Talker | None, *, run_options: RunOptions | None = None, stages: StageCallback = ignore_stage
) -> tuple[Observation, ...]:
    """Observations of a folder of videos, of a person's tracks (`read_person`), or of lip tracks (`read_lip_tracks`).

    Phones of lip tracks are aligned with the help of the base's recordings, and shown on its face
    (`corpus_tools.studies.evaluation.learning_curve`).

    Raises
    ------
    InputError
        The folder is missing or empty, or lip tracks have no base, or one that was pooled with lip tracks.
    DataError
        A file is damaged.
    """
    tracks = sorted(folder.glob(f"*{TRACK_SUFFIX}")) if folder.is_dir() else []
    if not tracks:
        return check_any_kept(observe(folder, run_options=run_options, on_progress=stages(f"reading {folder.name}")))
    if not _holds_points(tracks[0]):
        return read_person(folder)
    if base is None:
        raise InputError(f"{folder} holds lip tracks, which a base talker's recordings align; give --base")
    # what is held out here may have trained them
    if "pooled" in base.metadata:
        raise InputError(
            f"the networks of the base {base.metadata.get('name', '')} were pooled with lip tracks, perhaps these; "
            "give a base as `tts2face corpus build` writes it"
        )
    return lip_observations(align_lip_tracks(read_lip_tracks(folder), base, stages("aligning lip tracks")), base)


def _holds_points(path: Path) -> bool:
    try:
        with np.load(path, allow_pickle=False) as stored:
            return LIP_POINTS in stored.files
    except (OSError, ValueError, EOFError) as damaged:
        raise DataError(f"{path} is not a readable {TRACK_SUFFIX} file: {damaged}") from damaged
