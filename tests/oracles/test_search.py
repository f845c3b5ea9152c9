"""The indexed search against scoring every token in plain Python."""

import math

import numpy as np
import pytest

from tts2face.lips import token_search as select
from tts2face.lips.tokens import Tokens, phone_contexts

PHONES = 9


@pytest.fixture(scope="module")
def tokens() -> Tokens:
    """3,000 random tokens of nine phones in utterances of twelve."""
    stream = np.random.default_rng(12)
    phone = stream.integers(0, PHONES, 3000).astype(np.int32)
    utterance = np.repeat(np.arange(250, dtype=np.int32), 12)
    steps = stream.uniform(0.03, 0.3, (3000, 4))
    return Tokens(
        tuple("abcdefghi"), phone, utterance, np.cumsum(steps, axis=1), phone_contexts(phone, utterance, 0),
        np.zeros((1, 1), np.float32), np.array([0, 1]), 25.0,
    )  # fmt: skip


@pytest.fixture(scope="module")
def similarity() -> np.ndarray:
    matrix = np.random.default_rng(5).uniform(0, 1, (PHONES, PHONES)).round(1)  # rounded: equal scores do happen
    matrix = (matrix + matrix.T) / 2
    np.fill_diagonal(matrix, 1.0)
    return matrix


def slow_score(tokens, similarity, wanted, pair, rule):
    (n, token), (context, duration) = pair, rule
    total = 0.0
    for d in range(1, context + 1):
        left, right = 2 * d - 2, 2 * d - 1
        alike = similarity[wanted.context[n, left], tokens.context[token, left]]
        alike += similarity[wanted.context[n, right], tokens.context[token, right]]
        total += alike / (d + 1)
    own = [math.log(b - a) for a, b in zip(tokens.spans[token][:-1], tokens.spans[token][1:], strict=True)]
    apart = [abs(a - b) for a, b in zip(own, wanted.log_durations[n], strict=True)]
    return total - duration * (apart[1] + 0.5 * (apart[0] + apart[2]))


@pytest.mark.parametrize(("context", "k", "duration"), [(1, 1, 0.0), (4, 10, 0.0), (3, 40, 0.6), (6, 500, 0.2)])
def test_finds_exactly_what_scoring_every_token_finds(tokens, similarity, context, k, duration):
    stream = np.random.default_rng(context)
    phone = stream.integers(0, PHONES, 30).astype(np.int32)
    around = phone_contexts(phone, np.zeros(30, np.int32), 0)
    wanted = select.TokenQuery(phone, around, np.log(stream.uniform(0.03, 0.3, (30, 3))))
    found = select.best_tokens(
        wanted, select.context_index(tokens, similarity), context=context, k=k, duration=duration
    )
    for n in range(30):
        same = np.flatnonzero(tokens.phone == phone[n])
        scores = [slow_score(tokens, similarity, wanted, (n, token), (context, duration)) for token in same]
        ranked = sorted(zip([-round(score, 9) for score in scores], same.tolist(), strict=True))[:k]
        kept = found.tokens[n] >= 0
        assert kept.sum() == len(ranked)
        np.testing.assert_allclose(found.scores[n][kept], [-score for score, _ in ranked], rtol=0, atol=1e-8)
        if duration == 0.0:
            best = {token for score, token in ranked if score < ranked[-1][0]}
            assert best <= set(found.tokens[n].tolist())
        else:
            assert found.tokens[n][kept].tolist() == [token for _, token in ranked]


def test_the_weight_of_a_context_phone_is_one_over_its_distance_plus_one():
    assert select.context_weights(3).tolist() == [1 / 2, 1 / 3, 1 / 4]


def test_equal_scores_go_to_the_first_in_the_corpus():
    phone = np.zeros(6, np.int32)
    utterance = np.arange(6, dtype=np.int32)
    spans = np.tile([0.0, 0.1, 0.2, 0.3], (6, 1))
    tokens = Tokens(
        ("a",),
        phone,
        utterance,
        spans,
        phone_contexts(phone, utterance, 0),
        np.zeros((1, 1), np.float32),
        np.array([0]),
        25.0,
    )
    wanted = select.TokenQuery(phone[:1], tokens.context[:1], select.log_durations(spans[:1]))
    found = select.best_tokens(wanted, select.context_index(tokens, np.ones((1, 1))), context=2, k=3, duration=0.5)
    assert found.tokens.tolist() == [[0, 1, 2]]
