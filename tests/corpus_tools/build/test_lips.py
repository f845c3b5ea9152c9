"""Networks from phones to lips: their phone features, and equality of the networks expanded to one-hot phones."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from corpus_tools.recordings.observation import Observation
from corpus_tools.studies.evaluation.evaluate import EVALUATION_METADATA
from corpus_tools.training.network_training import TrainingOptions, WindowSamples, network_outputs, train_network
from corpus_tools.training.phone_codes import feature_table
from corpus_tools.training.phone_network import add_phone_network, expand_to_phones
from corpus_tools.training.train_talker import learn_talker
from lexicon.phones import ARTICULATORY_WEIGHTS, PHONES
from lexicon.sequence import SILENCE

KNOWN = ("b", "aɪ", "p", SILENCE)
N_SHOWN = 3
OPTIONS = TrainingOptions(hidden=(24, 16), n_epochs=40, weight_decay=0.0)


@pytest.fixture
def stream() -> np.random.Generator:
    return np.random.default_rng(0)


def test_phones_are_encoded_by_the_articulation_of_both_halves() -> None:
    b, diphthong, p, _ = feature_table(KNOWN)
    names = [f"{name} {half}" for half in ("first", "last") for name in ARTICULATORY_WEIGHTS]
    assert [name for name, one, other in zip(names, b, p, strict=True) if one != other] == [
        "voicing first",
        "voicing last",
    ]
    features = dict(zip(names, diphthong, strict=True))
    assert features["opening first"] > features["opening last"] > 0
    assert feature_table(PHONES).shape == (len(PHONES), 2 * len(ARTICULATORY_WEIGHTS))


def samples(stream: np.random.Generator, n_speakers: int = 1) -> WindowSamples:
    """Two outputs: the opening of the phone shown in the middle, and its product with the position."""
    shown = stream.integers(0, 4, (2000, N_SHOWN)).astype(np.int32)
    position = stream.uniform(0, 1, (2000, 1)).astype(np.float32)
    opening = np.array([0.0, 1.0, 0.2, -1.0], np.float32)[shown[:, 1]]
    targets = np.stack([opening, opening * position[:, 0]], axis=1)
    return WindowSamples(shown, position, targets, stream.integers(0, n_speakers, 2000))


def test_a_network_learns_what_phones_show(stream: np.random.Generator) -> None:
    known, table = samples(stream), feature_table(KNOWN)
    weights = train_network(known, table, np.ones((1, 2), np.float32), options=OPTIONS, seed=0)
    fresh = samples(stream)
    outputs = network_outputs(weights, table, fresh.shown, fresh.position, 0)
    assert np.sqrt(np.square(outputs - fresh.targets).mean()) < 0.25 * fresh.targets.std()


def test_the_same_seed_gives_the_same_bytes_and_another_seed_others(stream: np.random.Generator) -> None:
    known, table, importance = samples(stream), feature_table(KNOWN), np.ones((1, 2), np.float32)
    few = TrainingOptions(hidden=(8, 8), n_epochs=1, weight_decay=1e-5)
    one, same, other = (train_network(known, table, importance, options=few, seed=seed) for seed in (3, 3, 4))
    assert [values.tobytes() for values in one] == [values.tobytes() for values in same]
    assert one[0].tobytes() != other[0].tobytes()


def test_a_step_equals_that_of_dense_matrices_in_double_precision(stream: np.random.Generator) -> None:
    every, table = samples(stream), feature_table(KNOWN)
    known = WindowSamples(every.shown[:128], every.position[:128], every.targets[:128], every.speaker[:128])
    options = TrainingOptions(hidden=(8, 6), n_epochs=1, weight_decay=0.0)
    stepped = train_network(known, table, np.ones((1, 2), np.float32), options=options, seed=5)
    begun = train_network(known, table, np.ones((1, 2), np.float32), options=replace(options, n_epochs=0), seed=5)
    rows, place, bias, inner, inner_bias, outer, outer_bias = (one.astype(np.float64) for one in begun)
    inputs = np.concatenate([*table[known.shown].transpose(1, 0, 2), known.position], axis=1).astype(np.float64)
    first = inputs @ np.concatenate([*rows, place]) + bias
    second = np.maximum(first, 0) @ inner + inner_bias
    error = (np.maximum(second, 0) @ outer + outer_bias - known.targets) / 128
    back = (error @ outer.T) * (second > 0)
    front = (back @ inner.T) * (first > 0)
    slopes = (inputs.T @ front, np.maximum(first, 0).T @ back, np.maximum(second, 0).T @ error)
    changes = (
        np.concatenate([*(stepped[0] - begun[0]), stepped[1] - begun[1]]),
        stepped[3] - begun[3],
        stepped[5] - begun[5],
    )
    for slope, change in zip(slopes, changes, strict=True):
        clear = np.abs(slope) > 1e-5  # the first step of Adam is the learning rate times the sign of the gradient
        assert clear.any()
        np.testing.assert_allclose(change[clear], -1e-3 * np.sign(slope[clear]), rtol=0.06)


def test_outputs_that_a_speaker_lacks_do_not_count(stream: np.random.Generator) -> None:
    known, table = samples(stream, 2), feature_table(KNOWN)
    importance = np.array([[1.0, 1.0], [0.0, 1.0]], np.float32)
    wrong = known.targets.copy()
    wrong[known.speaker == 1, 0] = 100.0
    damaged = WindowSamples(known.shown, known.position, wrong, known.speaker)
    few = TrainingOptions(hidden=(8, 8), n_epochs=2, weight_decay=0.0)
    one, other = (train_network(some, table, importance, options=few, seed=0) for some in (known, damaged))
    assert [values.tobytes() for values in one] == [values.tobytes() for values in other]


def test_weights_by_phone_tell_what_weights_by_feature_do(stream: np.random.Generator) -> None:
    known, table = samples(stream), feature_table(KNOWN)
    few = TrainingOptions(hidden=(8, 8), n_epochs=1, weight_decay=0.0)
    weights = train_network(known, table, np.ones((1, 2), np.float32), options=few, seed=0)
    (first, inner, outer), (biases, inner_biases, outer_biases) = expand_to_phones(
        weights, table, 2, np.full(2, 2.0, np.float32)
    )
    ones = np.eye(len(KNOWN), dtype=np.float32)[known.shown].reshape(len(known.shown), -1)
    hidden = np.maximum(np.concatenate([ones, known.position], axis=1) @ first + biases, 0)
    dense = np.maximum(hidden @ inner + inner_biases, 0) @ outer + outer_biases
    outputs = network_outputs(weights, table, known.shown, known.position, 0)
    np.testing.assert_allclose(dense, 2 * outputs, rtol=1e-3, atol=1e-4)


def test_a_single_utterance_gives_no_phone_network(make_observation: Callable[..., Observation]) -> None:
    talker = learn_talker([make_observation("u0", 0, 75)], n_speech=5, n_other=3, metadata=EVALUATION_METADATA)
    assert add_phone_network(talker) is talker
