"""Training of score maps, and the calibration of a face."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from corpus_tools.training.calibrate_face import (
    calibrate_face,
    correct_score_map,
    mirrored_name,
    symmetrise_score_map,
    vary_poses,
)
from corpus_tools.training.calibrate_file import calibrate_face_file
from corpus_tools.training.score_map import MAX_LOGIT, add_score_map, clipped_logits, fit_score_map, read_mouth_scores
from lexicon.errors import DataError
from tts2face.models.face_file import read_face
from tts2face.models.score_map import N_SCORES, SCORE_SHAPES, logistic
from tts2face.models.talker_file import load_talker
from tts2face.storage.shipped import find_file
from tts2face.storage.tensors import read_tensors
from tts2face.video.blendshapes import BlendshapeReader

NAMES = ("jawOpen", "mouthClose", "mouthPucker", "mouthSmileLeft", "mouthSmileRight")
MIRROR = [0, 1, 2, 4, 3]


def known_scores(values: np.ndarray) -> np.ndarray:
    """Scores that depend steeply on products of the inputs as well."""
    slopes = np.random.default_rng(8).normal(size=(values.shape[1], N_SCORES))
    return logistic(3 * values @ slopes - 2 + 4 * (values[:, :1] * values[:, 1:2]))


def test_a_map_learns_known_scores() -> None:
    values = np.random.default_rng(0).uniform(0, 1, (3000, len(NAMES)))
    found = fit_score_map(NAMES, values[:2500], known_scores(values[:2500]))
    error = found.scores(values[2500:]) - known_scores(values[2500:])
    assert np.sqrt(np.square(error).mean()) < 0.03
    again = fit_score_map(NAMES, values[:2500], known_scores(values[:2500]))
    assert np.array_equal(again.hidden, found.hidden)


def test_logits_are_finite_for_every_score() -> None:
    assert clipped_logits(np.array([0.0, 0.5, 1.0])) == pytest.approx([-MAX_LOGIT, 0.0, MAX_LOGIT])


def test_a_correction_removes_a_linear_error() -> None:
    values = np.random.default_rng(1).uniform(0, 1, (2000, len(NAMES)))
    fitted = fit_score_map(NAMES, values, known_scores(values))
    shifted = replace(fitted, bias=fitted.bias - 1, direct=fitted.direct + 0.5)
    before, after = (
        np.abs(found.scores(values) - known_scores(values)).mean()
        for found in (shifted, correct_score_map(shifted, values, known_scores(values)))
    )
    assert after < before / 2


def test_a_symmetric_map_reads_mirrored_poses_alike() -> None:
    values = np.random.default_rng(2).uniform(0, 1, (500, len(NAMES)))
    fitted = fit_score_map(NAMES, values, known_scores(values))
    even = symmetrise_score_map(fitted, MIRROR)
    assert even.logits(values) == pytest.approx(even.logits(values[:, MIRROR]), abs=1e-4)
    assert even.logits(values) == pytest.approx(
        (fitted.logits(values) + fitted.logits(values[:, MIRROR])) / 2, abs=1e-4
    )
    assert [mirrored_name(name) for name in NAMES] == [NAMES[at] for at in MIRROR]


def test_varied_poses_stay_within_limits() -> None:
    rng = np.random.default_rng(3)
    poses = vary_poses(np.full((4, len(NAMES)), 0.5), NAMES, 300, rng)
    assert poses.shape == (300, len(NAMES))
    assert poses.min() >= 0.0
    assert poses.max() == 1.0
    assert poses.std(axis=0).min() > 0.1


def test_a_face_without_a_shape_is_refused(face_model: Path) -> None:
    head = read_face(find_file("head", "face"))
    names = tuple(name.replace("mouthPucker", "mouthKiss") for name in head.shape_names)
    with pytest.raises(DataError, match="lacks the shape mouthPucker"):
        calibrate_face(replace(head, shape_names=names), load_talker("grid_s1"), model=face_model)


def test_a_talkers_map_gives_the_scores_of_its_landmarks(face_model: Path) -> None:
    reader, starter = BlendshapeReader(face_model), load_talker("grid_s1")
    few = replace(starter, utterances=starter.utterances[:40], scores=None)
    scores = add_score_map(few, reader).scores
    assert scores is not None
    other = np.concatenate([one.shape[::5, : starter.model.n_speech] for one in starter.utterances[100:120]])
    read = read_mouth_scores(starter.model.shapes(other), reader)
    error = scores.scores(other.astype(np.float64)) - read
    assert np.sqrt(np.square(error).mean(axis=0)).max() < 0.04


def test_a_calibrated_file_keeps_everything_else(
    tmp_path: Path, face_model: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("corpus_tools.training.calibrate_face.N_POSES", 60)
    monkeypatch.setattr("corpus_tools.training.calibrate_face.N_DRAWN", ((3, 3), (3, 3)))
    out = tmp_path / "new.face"
    steps: list[tuple[int, int]] = []
    calibrate_face_file("ada", out, model=face_model, on_progress=lambda *step: steps.append(step))
    assert steps == [(1, 2), (2, 2)]
    before, header = read_tensors(find_file("ada", "face"), "face", 1)
    after, new_header = read_tensors(out, "face", 1)
    assert before.keys() == after.keys()
    assert all(np.array_equal(before[name], after[name]) for name in before if not name.startswith("scores."))
    assert not np.array_equal(before["scores.direct"], after["scores.direct"])
    assert new_header == header
    scores = read_face(out).scores
    assert scores is not None
    assert set(scores.inputs) >= {name for names in SCORE_SHAPES.values() for name in names}
