"""Talkers that are learnt from observations with known directions of motion."""

from dataclasses import replace

import numpy as np
import pytest

from corpus_tools.describe_talker import describe
from corpus_tools.training.train_talker import learn_talker, mean_rotation, resting_frames
from lexicon.errors import DataError, InputError
from tts2face.face.deformation import head_rotation
from tts2face.models.landmarks import MOUTH_REGION, N_LANDMARKS, lip_opening
from tts2face.models.talker_file import read_talker, write_talker

from .conftest import known_directions  # noqa: TID252 - a test's own data

METADATA = {"name": "made", "created": "2000-01-01"}


@pytest.fixture
def observations(make_observation):
    return [make_observation(f"u{seed}", seed) for seed in range(8)]


@pytest.fixture
def talker(observations):
    return learn_talker(observations, n_speech=3, n_other=2, metadata=METADATA)


def test_modes_are_orthonormal_and_keep_to_their_regions(talker):
    basis = talker.model.basis
    flat = basis.reshape(len(basis), -1)
    np.testing.assert_allclose(flat @ flat.T, np.eye(5), atol=1e-5)  # float32
    mouth = np.isin(np.arange(N_LANDMARKS), MOUTH_REGION)
    assert np.abs(basis[:3, ~mouth]).max() == 0
    assert np.abs(basis[3:, mouth]).max() == 0


def test_known_directions_are_found_with_their_spread(talker, observations):
    flat = talker.model.basis.reshape(5, -1)
    overlap = np.abs(flat @ known_directions().reshape(3, -1).T)
    span = np.linalg.norm(overlap[:2, :2], axis=0), overlap[3, 2]
    np.testing.assert_allclose(span[0], 1, atol=1e-3)
    np.testing.assert_allclose(span[1], 1, atol=1e-3)
    parameters = np.concatenate([utterance.shape for utterance in talker.utterances])
    np.testing.assert_allclose(parameters.std(axis=0)[:2], talker.model.spread[:2], rtol=1e-4)
    assert (np.diff(talker.model.spread[:3]) <= 0).all()


def test_parameters_give_the_landmarks_back(talker, observations):
    for utterance, observation in zip(talker.utterances, observations, strict=True):
        np.testing.assert_allclose(talker.model.shapes(utterance.shape), observation.landmarks, atol=1e-2)  # mm


def test_the_face_rests_where_the_lips_were_closed_before_speech(talker, observations):
    assert [resting_frames(observation).sum() for observation in observations] == [20] * 8
    rest = talker.model.shapes(talker.model.rest[None])
    np.testing.assert_allclose(rest[0], observations[0].landmarks[0], atol=1e-2)
    assert lip_opening(rest)[0] < 0.001


def test_the_head_is_measured_from_its_mean_pose(talker, observations):
    angles = np.concatenate([utterance.head[:, :3] for utterance in talker.utterances])
    np.testing.assert_allclose(angles.mean(axis=0), 0, atol=0.005)
    np.testing.assert_allclose(mean_rotation(observations), head_rotation(0.3, -0.2, 0.1), atol=0.02)


def test_the_same_observations_give_the_same_bytes(observations, tmp_path):
    for name in ("a", "b"):
        write_talker(tmp_path / f"{name}.talker", learn_talker(observations, n_speech=3, n_other=2, metadata=METADATA))
    assert (tmp_path / "a.talker").read_bytes() == (tmp_path / "b.talker").read_bytes()


def test_a_talker_survives_its_file(talker, tmp_path):
    write_talker(tmp_path / "made.talker", talker)
    again = read_talker(tmp_path / "made.talker")
    np.testing.assert_array_equal(again.model.rest, talker.model.rest)
    for before, after in zip(talker.utterances, again.utterances, strict=True):
        assert before.phones.phones == after.phones.phones
        np.testing.assert_allclose(before.shape, after.shape, atol=talker.model.spread.max() / 2000)


def test_description(talker):
    described = describe(talker)
    assert (described.n_utterances, described.n_triphones) == (8, 3)
    assert described.phones == (("b", 8), ("n", 8), ("ɪ", 8))
    assert described.minutes == pytest.approx(8 * 60 / 25 / 60)
    text = described.text()
    assert "name:        made" in text
    assert "utterances:  8 (0.3 minutes at 25 frames/s)" in text
    assert "b 8" in text


def test_no_observation():
    with pytest.raises(InputError, match="no recording could be used"):
        learn_talker([], metadata=METADATA)


def test_recordings_of_two_speeds(observations):
    observations[3] = replace(observations[3], fps=30.0)
    with pytest.raises(DataError, match="u3 has 30 frames per second, others 25"):
        learn_talker(observations, n_speech=3, n_other=2, metadata=METADATA)


def test_more_modes_than_frames(observations):
    with pytest.raises(InputError, match="have no 600 modes"):
        learn_talker(observations, n_speech=600, n_other=2, metadata=METADATA)
