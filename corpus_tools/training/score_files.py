"""Score maps added to talker and face files; everything else in a file keeps its bytes."""

from pathlib import Path

from corpus_tools.training.calibrate_face import calibrate_face
from corpus_tools.training.train_score_map import add_score_map
from tts2face.models import face_file, talker
from tts2face.models.face_layout import SCORE_INPUTS
from tts2face.models.score_map import SCORE_MAP_PREFIX, score_map_arrays
from tts2face.storage.files import find_file
from tts2face.storage.tensors import read_tensors, write_tensors
from tts2face.types import Progress
from tts2face.video.blendshapes import BlendshapeReader


def calibrate_face_file(
    face: str, out: Path, *, source: str = "grid_s1", model: Path | None = None, on_progress: Progress | None = None
) -> None:
    """Write a face file with its score map, which replaces one that it has.

    Parameters
    ----------
    face
        Shipped face, or path of a ``.face`` file.
    source
        Talker with a score map, whose speech gives the poses.

    Raises
    ------
    InputError
        There is no such face or talker.
    DataError
        The face cannot be calibrated, or a file is damaged.
    BackendError
        The face tracker or its models are missing, or the file cannot be written.
    """
    path = find_file(face, face_file.KIND)
    calibrated = calibrate_face(
        face_file.read_face(path), talker.load_talker(source), model=model, on_progress=on_progress
    )
    if calibrated.scores is not None:
        added = score_map_arrays(calibrated.scores)
        _add(path, out, (face_file.KIND, face_file.FORMAT_VERSION), added, {SCORE_INPUTS: calibrated.scores.inputs})


def add_talker_scores(name: str, out: Path, *, model: Path | None = None) -> None:
    """Write a talker file with its score map, which replaces one that it has; errors as `calibrate_face_file`."""
    path = find_file(name, talker.KIND)
    scored = add_score_map(talker.read_talker(path), BlendshapeReader(model))
    _add(path, out, (talker.KIND, talker.FORMAT_VERSION), score_map_arrays(scored.scores), {})


def _add(path: Path, out: Path, kind: tuple[str, int], added: dict, header: dict) -> None:  # type: ignore[type-arg]
    arrays, known = read_tensors(path, *kind)
    kept = {name: array for name, array in arrays.items() if not name.startswith(SCORE_MAP_PREFIX)}
    write_tensors(out, *kind, kept | added, known | {name: list(value) for name, value in header.items()})
