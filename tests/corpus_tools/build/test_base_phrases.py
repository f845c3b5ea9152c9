"""Phrases by the networks of a base: what they hold, and what a talker's networks learn from them."""

import hashlib
import os
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cli.main import run
from corpus_tools.recordings.observation import Observation
from corpus_tools.recordings.observe import Observations
from corpus_tools.studies.evaluation.evaluate import EVALUATION_METADATA
from corpus_tools.training.network_training import TrainingOptions
from corpus_tools.training.phone_network import add_phone_network
from corpus_tools.training.pooling.base_speech import (
    DURATION_SPREAD,
    EDGE_SILENCE_S,
    N_PHRASES,
    TEMPI,
    base_speech,
    english_phrases,
)
from corpus_tools.training.pooling.speech import PooledSpeech
from corpus_tools.training.train_talker import learn_talker
from lexicon.errors import InputError
from lexicon.phones import ARPABET
from lexicon.sequence import SILENCE
from tests.corpus_tools.speaking import FPS, OPENINGS, observation
from tts2face.models.audio_map import FEATURE_SIZES, AudioMap
from tts2face.models.landmarks import lip_opening
from tts2face.models.talker import Talker
from tts2face.models.talker_file import read_talker, write_talker

PASSES = TrainingOptions(hidden=(24, 16), n_epochs=60, weight_decay=1e-4)
FEW_PASSES = replace(PASSES, n_epochs=4)  # where it does not matter what the networks have learnt
HIDDEN = "ɑ"  # the widest of the artificial phones; no other shares its features
OTHER_MACHINE = """
import sys
from pathlib import Path
from corpus_tools.training import phone_network
from corpus_tools.training.pooling import base_speech as phrases
from tests.corpus_tools.build.test_base_phrases import FEW_PASSES, network_bytes
phrases.N_PHRASES, phone_network.MIN_FRAMES, phone_network.TRAINING = 40, 100, FEW_PASSES
print(network_bytes(Path(sys.argv[1])))
"""


@pytest.fixture(autouse=True)
def few_recordings(monkeypatch: pytest.MonkeyPatch) -> None:
    """Networks from a minute, with more passes over few frames, and fewer phrases."""
    monkeypatch.setattr("corpus_tools.training.phone_network.MIN_FRAMES", 100)
    monkeypatch.setattr("corpus_tools.training.phone_network.TRAINING", PASSES)
    monkeypatch.setattr("corpus_tools.training.pooling.base_speech.N_PHRASES", 40)


@pytest.fixture(scope="module")
def recordings() -> list[Observation]:
    """Forty utterances of the base, and those of which the user says the ones without `HIDDEN`."""
    return [observation(number) for number in range(100)]


@pytest.fixture(scope="module")
def base(recordings: list[Observation]) -> Talker:
    """A talker who says all artificial phones, with networks."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("corpus_tools.training.phone_network.MIN_FRAMES", 100)
        patched.setattr("corpus_tools.training.phone_network.TRAINING", PASSES)
        return add_phone_network(learn_talker(recordings[:40], metadata={**EVALUATION_METADATA, "name": "Ann"}))


def without_hidden(recordings: Sequence[Observation]) -> list[Observation]:
    return [one for one in recordings if HIDDEN not in one.phones.phones]


def test_phrases_hold_every_english_phone_and_are_always_the_same() -> None:
    phrases = english_phrases(N_PHRASES)
    assert set(ARPABET.values()) <= {label for one in phrases for label in one.phones}
    for one, again in zip(english_phrases(20), phrases, strict=False):
        assert one.phones == again.phones
        np.testing.assert_array_equal(one.edges, again.edges)
    assert all((one.phones[0], one.phones[-1]) == (SILENCE, SILENCE) for one in phrases)
    assert all(one.durations[0] == pytest.approx(EDGE_SILENCE_S) for one in phrases)


def test_durations_vary_about_the_nominal_ones() -> None:
    """/n/ has 0.07 s; its logarithm has the variances of the tempo and of the single durations."""
    durations = np.concatenate([one.durations[np.array(one.phones) == "n"] for one in english_phrases(200)])
    assert np.median(durations) == pytest.approx(0.07, rel=0.1)
    tempo = np.log(np.linspace(*TEMPI, 1001)).std()
    assert np.log(durations).std() == pytest.approx(np.hypot(tempo, DURATION_SPREAD), rel=0.15)


def test_speech_of_the_base_is_z_scored_over_its_phrases(base: Talker) -> None:
    said = base_speech(base)
    frames = np.concatenate([one.features[one.is_used] for one in said])
    moving = frames.std(axis=0) > 1e-3  # the artificial mouth moves neither chin nor lips
    np.testing.assert_allclose(frames.mean(axis=0), 0.0, atol=1e-9)
    np.testing.assert_allclose(frames.std(axis=0)[moving], 1.0, rtol=1e-9)
    assert moving[:2].all()
    assert mean_opening(said, HIDDEN) > mean_opening(said, "i") > mean_opening(said, "p")


def mean_opening(said: Sequence[PooledSpeech], label: str) -> float:
    """Mean z-scored opening in the middles of a phone."""
    found = []
    for one in said:
        middles = (one.phones.edges[:-1] + one.phones.edges[1:]) / 2
        here = np.array(one.phones.phones) == label
        found.extend(np.interp(middles[here], np.arange(len(one.features)) / one.fps, one.features[:, 0]))
    return float(np.mean(found))


def test_a_phone_that_only_the_base_has_recorded_is_learnt_from_it(base: Talker, recordings: list[Observation]) -> None:
    user = learn_talker(without_hidden(recordings[40:]), metadata=EVALUATION_METADATA)
    tests = [one for one in recordings[40:] if HIDDEN in one.phones.phones][:20]
    alone, with_base = add_phone_network(user), add_phone_network(user, base_speech(base))
    errors = [opening_errors(one, tests) for one in (alone, with_base)]
    assert with_base.network is not None
    assert with_base.network.weights[-1].shape[2] == user.model.n_speech
    assert np.mean(errors[1]) < 0.7 * np.mean(errors[0])


def opening_errors(talker: Talker, tests: Sequence[Observation]) -> np.ndarray:
    """Differences of the lip opening in the middles of the hidden phone, by the networks alone, in eye distances."""
    assert talker.network is not None
    found = []
    for one in tests:
        middles = (one.phones.edges[:-1] + one.phones.edges[1:])[np.array(one.phones.phones) == HIDDEN] / 2
        known = [label if label in talker.network.inventory else "i" for label in one.phones.phones]
        made = talker.network.parameters(replace(one.phones, phones=tuple(known)), middles)
        opening = lip_opening(talker.model.shapes(made))
        real = np.interp(middles, np.arange(len(one.landmarks)) / FPS, lip_opening(one.landmarks))
        found.append(np.abs(opening - real))
    return np.concatenate(found)


def test_a_base_without_networks_is_refused(base: Talker) -> None:
    with pytest.raises(InputError, match="talker Ann has no phone networks; name another base, or --base none"):
        base_speech(replace(base, network=None))


def test_the_build_of_a_long_talker_states_the_base_of_its_networks(
    base: Talker, recordings: list[Observation], face_model: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    n_features, n_speech = FEATURE_SIZES["mel"], base.model.n_speech
    inner = np.random.default_rng(1).normal(0.0, 0.1, (n_speech, n_features)).astype(np.float32)
    outer = np.diag(base.model.spread[:n_speech])
    zeros, ones = np.zeros(n_features, np.float32), np.ones(n_features, np.float32)
    heard = AudioMap("mel", 0, 0, zeros, ones, (inner, outer), (zeros[:n_speech], base.model.rest[:n_speech]), "linear")
    known = replace(base, metadata={**base.metadata, "pooled": "lips, CC0"}, audio_maps={"voices": heard})
    write_talker(tmp_path / "base.talker", known)
    own = without_hidden(recordings[40:])
    monkeypatch.setattr("corpus_tools.training.phone_network.TRAINING", FEW_PASSES)
    monkeypatch.setattr("corpus_tools.build_talker.observe", lambda *_, **__: Observations(tuple(own), (), ()))
    monkeypatch.setattr("corpus_tools.training.short_talker.MIN_OWN_MINUTES", 0.2)
    monkeypatch.setattr("corpus_tools.build_talker.add_score_map", lambda talker, _: talker)
    command = ["corpus", "build", str(tmp_path / "recordings"), "--model", str(face_model), "--out"]
    assert run([*command, str(tmp_path / "me.talker"), "--base", str(tmp_path / "base.talker")]) == 0
    made = read_talker(tmp_path / "me.talker")
    assert made.metadata["network_base"] == {"name": "Ann", "pooled": "lips, CC0", "phrases": 40}
    assert made.metadata["licence"] == f"recordings: not stated; base: {base.metadata['licence']}"
    assert [one.name for one in made.utterances] == [one.name for one in own]
    assert made.network is not None
    assert {HIDDEN, "ʃ"} < set(made.network.inventory)
    sound = np.random.default_rng(2).normal(size=(50, n_features))
    lips = [lip_opening(one.model.shapes(one.audio_maps["voices"].parameters(sound))) for one in (known, made)]
    assert np.corrcoef(*lips)[0, 1] > 0.99
    assert run([*command, str(tmp_path / "alone.talker"), "--base", "none"]) == 0
    alone = read_talker(tmp_path / "alone.talker")
    assert "network_base" not in alone.metadata
    assert alone.network is not None
    assert set(alone.network.inventory) == set(OPENINGS) - {HIDDEN}


def network_bytes(path: Path) -> str:
    """Digest of networks trained on a talker's utterances and on phrases by its own networks."""
    talker = read_talker(path)
    trained = add_phone_network(replace(talker, network=None), base_speech(talker))
    assert trained.network is not None
    return hashlib.sha256(b"".join(one.tobytes() for one in trained.network.weights)).hexdigest()


def test_networks_have_the_same_bytes_on_another_processor_and_with_other_numbers_of_threads(
    base: Talker, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Code without the extensions of this processor stands for another machine."""
    monkeypatch.setattr("corpus_tools.training.phone_network.TRAINING", FEW_PASSES)
    write_talker(tmp_path / "base.talker", base)
    other = {
        "NUMBA_CPU_NAME": "generic", "NUMBA_CACHE_DIR": str(tmp_path / "kernels"), "OPENBLAS_CORETYPE": "Nehalem",
        "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1",
    }  # fmt: skip
    done = subprocess.run(
        [sys.executable, "-c", OTHER_MACHINE, str(tmp_path / "base.talker")],
        env=os.environ | other, capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert done.stdout.split()[-1] == network_bytes(tmp_path / "base.talker")
