"""Lip tracks as observations: their curves, their cuts at pauses, and the folders of a learning curve."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from corpus_tools.measures.reference import LipCurves
from corpus_tools.studies.evaluation.lip_observations import MIN_PART_S, lip_observations
from corpus_tools.studies.evaluation.material import read_material
from corpus_tools.training.pooling.speech import PooledSpeech, spoken_sequence, talker_features
from lexicon.errors import DataError, InputError
from lexicon.sequence import SILENCE
from tests.corpus_tools.build.test_people import person, write_tracks
from tts2face.models.talker import Talker
from tts2face.models.talker_file import load_talker


@pytest.fixture(scope="module")
def shipped() -> Talker:
    talker = load_talker("grid_s1")
    return replace(talker, utterances=talker.utterances[:80], metadata={"name": "grid_s1"})


@pytest.fixture(scope="module")
def track(shipped: Talker) -> PooledSpeech:
    """Ten utterances of the talker one after another, as if another speaker had the same lips."""
    features, labels, ends = [], [], []
    for at in range(10):
        one = shipped.utterances[at]
        begin = sum(map(len, features)) / shipped.fps
        features.append(talker_features(shipped, at))
        labels += one.phones.phones
        ends += [begin + edge for edge in one.phones.edges[1:]]
        ends[-1] = begin + len(features[-1]) / shipped.fps
    values = np.concatenate(features)
    scored = (values - values.mean(axis=0)) / values.std(axis=0)
    phones = spoken_sequence(labels, np.array(ends))
    return PooledSpeech("t01", shipped.fps, scored, phones, np.ones(len(values), bool))


def test_landmarks_show_the_opening_and_width_of_the_track(shipped: Talker, track: PooledSpeech) -> None:
    made = lip_observations([track], shipped)
    curves = np.concatenate([LipCurves.of(one.landmarks).values() for one in made])
    features = track.features[: len(curves)]
    for at in range(2):
        assert np.corrcoef(curves[:, at], features[:, at])[0, 1] > 0.98


def test_tracks_are_cut_in_silence(shipped: Talker, track: PooledSpeech) -> None:
    made = lip_observations([track], shipped)
    assert len(made) > 3
    assert [one.name for one in made] == [f"t01-{number:03d}" for number in range(1, len(made) + 1)]
    spoken = [label for one in made for label in one.phones.phones if label != SILENCE]
    assert spoken == [label for label in track.phones.phones if label != SILENCE][: len(spoken)]
    begin = 0.0
    for one in made:
        assert len(one.landmarks) / one.fps >= MIN_PART_S
        assert (one.phones.edges[0], one.phones.edges[-1]) == (0.0, pytest.approx(len(one.landmarks) / one.fps))
        assert one.phones.phones[-1] == SILENCE
        assert np.abs(track.phones.edges[:, None] - (begin + one.phones.edges[1:-1])).min(axis=0).max() < 1e-9
        begin += len(one.landmarks) / one.fps


def test_tracks_of_a_person_need_no_base(tmp_path: Path) -> None:
    read = read_material(write_tracks(tmp_path / "person"), None)
    assert [one.name for one in read] == [one.name for one in person(2.0, "p")]


def test_lip_tracks_need_a_base_that_does_not_know_them(tmp_path: Path, shipped: Talker) -> None:
    np.savez(tmp_path / "t.npz", points=np.zeros((3, 68, 2)), fps=25.0)
    with pytest.raises(InputError, match="holds lip tracks, which a base talker's recordings align; give --base"):
        read_material(tmp_path, None)
    pooled = replace(shipped, metadata={"name": "grid_s1", "pooled": "tracks"})
    with pytest.raises(InputError, match="networks of the base grid_s1 were pooled with lip tracks, perhaps these"):
        read_material(tmp_path, pooled)


def test_a_damaged_file_is_named(tmp_path: Path) -> None:
    (tmp_path / "t.npz").write_bytes(b"nothing")
    with pytest.raises(DataError, match=r"t\.npz is not a readable \.npz file"):
        read_material(tmp_path, None)
