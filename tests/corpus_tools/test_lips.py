"""Networks from phones to lips: their phone features, and equality of the networks expanded to one-hot phones."""

from collections.abc import Callable

import numpy as np
import pytest

from corpus_tools.evaluation.evaluate import EVALUATION_METADATA
from corpus_tools.recordings.observation import Observation
from corpus_tools.training.train_phone_network import add_phone_network, encode_windows, expand_to_phones, feature_table
from corpus_tools.training.train_talker import learn_talker
from lexicon.phones import ARTICULATORY_WEIGHTS, PHONES
from lexicon.sequence import SILENCE

KNOWN = ("b", "aɪ", "p", SILENCE)
N_SHOWN = 3


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


def test_inputs_are_the_lines_of_the_table_beside_each_other(stream: np.random.Generator) -> None:
    shown, place = stream.integers(0, 4, (5, N_SHOWN)), stream.normal(size=(5, 4)).astype(np.float32)
    table = feature_table(KNOWN)
    dense = encode_windows(shown, place, table).toarray()
    for row, labels, where in zip(dense, shown, place, strict=True):
        np.testing.assert_array_equal(row, [*(value for label in labels for value in table[label]), *where])


def test_weights_by_phone_tell_what_weights_by_feature_do(stream: np.random.Generator) -> None:
    shown, place = stream.integers(0, 4, (5, N_SHOWN)), stream.normal(size=(5, 4)).astype(np.float32)
    table, ones = feature_table(KNOWN), np.eye(4, dtype=np.float32)
    weights = stream.normal(size=(N_SHOWN * table.shape[1] + 4, 6)).astype(np.float32)
    expanded = encode_windows(shown, place, ones) @ expand_to_phones(weights, table, N_SHOWN)
    np.testing.assert_allclose(expanded, encode_windows(shown, place, table) @ weights, rtol=1e-4, atol=1e-4)
    np.testing.assert_array_equal(
        expand_to_phones(weights[: 4 * N_SHOWN + 4], ones, N_SHOWN), weights[: 4 * N_SHOWN + 4]
    )


def test_a_single_utterance_gives_no_phone_network(make_observation: Callable[..., Observation]) -> None:
    talker = learn_talker([make_observation("u0", 0, 75)], n_speech=5, n_other=3, metadata=EVALUATION_METADATA)
    assert add_phone_network(talker) is talker
