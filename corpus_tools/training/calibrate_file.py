"""Score maps added to face files; everything else in a file keeps its bytes."""

from pathlib import Path

from corpus_tools.training.calibrate_face import calibrate_face
from tts2face.models import face_file
from tts2face.models.codec import stored_arrays
from tts2face.models.face_loading import load_face
from tts2face.models.face_schema import SCORE_INPUTS
from tts2face.models.score_map import SCORES, ScoreMap
from tts2face.models.talker_file import load_talker
from tts2face.storage.shipped import find_file
from tts2face.storage.tensors import read_tensors, write_tensors
from tts2face.types import Progress, ignore_progress


def calibrate_face_file(
    face: str, out: Path, *, source: str = "grid_s1", model: Path | None = None, on_progress: Progress = ignore_progress
) -> None:
    """Write a face file with its score map, which replaces one that it has; pictures show the face's own haircut.

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
    calibrated = calibrate_face(load_face(str(path)), load_talker(source), model=model, on_progress=on_progress)
    if calibrated.scores is not None:
        _replace_score_map(path, out, calibrated.scores)


def _replace_score_map(path: Path, out: Path, scores: ScoreMap) -> None:
    arrays, header = read_tensors(path, face_file.KIND, face_file.FORMAT_VERSION)
    kept = {name: array for name, array in arrays.items() if not name.startswith(f"{SCORES}.")}
    header = header | {SCORE_INPUTS: list(scores.inputs)}
    written = kept | stored_arrays(scores, SCORES)
    write_tensors(out, face_file.KIND, face_file.FORMAT_VERSION, written, header, is_packed=True)
