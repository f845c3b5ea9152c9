"""The similarity of phones against its formula written out in loops, and against what it must mean."""

import math

import numpy as np
import pytest

from lexicon.errors import InputError
from tts2face.lips.similarity import PRIOR_TOKENS, SHARPNESS, phone_similarity


def slow_matrix(samples, phone, n_phones, spread):
    n, n_samples, n_dims = samples.shape
    z = [[[samples[i][s][d] / spread[d] for d in range(n_dims)] for s in range(n_samples)] for i in range(n)]
    of = [[i for i in range(n) if phone[i] == p] for p in range(n_phones)]
    mean = [[[sum(z[i][s][d] for i in of[p]) / len(of[p]) for d in range(n_dims)] for s in range(n_samples)]
            for p in range(n_phones)]  # fmt: skip

    def variance(p, s, d):
        own = sum((z[i][s][d] - mean[p][s][d]) ** 2 for i in of[p])
        pooled = sum((z[i][s][d] - mean[phone[i]][s][d]) ** 2 for i in range(n)) / n + 1e-6
        return (own + PRIOR_TOKENS * pooled) / (len(of[p]) + PRIOR_TOKENS)

    def distance(p, q):
        above = below = 0.0
        for s in range(n_samples):
            for d in range(n_dims):
                weight = spread[d] ** 2 * 2 / (variance(p, s, d) + variance(q, s, d))
                above += weight * (mean[p][s][d] - mean[q][s][d]) ** 2
                below += weight
        return math.sqrt(above / below)

    apart = [[distance(p, q) for q in range(n_phones)] for p in range(n_phones)]
    typical = sum(map(sum, apart)) / (n_phones * (n_phones - 1))
    return [[math.exp(-SHARPNESS * d / typical) for d in row] for row in apart]


def test_follows_the_formula():
    stream = np.random.default_rng(2)
    phone = np.array([0, 0, 0, 1, 1, 2, 2, 2, 2, 3])
    samples = stream.normal(size=(10, 3, 4)) + phone[:, None, None] * np.array([1.0, 0.3, -0.5, 0.0])
    spread = np.array([3.0, 2.0, 1.0, 0.5])
    found = phone_similarity(samples, phone, tuple("abcd"), spread)
    np.testing.assert_allclose(found.matrix, slow_matrix(samples, phone, 4, spread), rtol=1e-9)


def test_lies_in_unit_range_symmetric_with_ones_on_the_diagonal():
    stream = np.random.default_rng(4)
    matrix = phone_similarity(
        stream.normal(size=(50, 5, 3)), stream.integers(0, 6, 50), tuple("abcdef"), np.ones(3)
    ).matrix
    assert (matrix >= 0).all()
    assert (matrix <= 1).all()
    assert (np.diag(matrix) == 1).all()
    np.testing.assert_allclose(matrix, matrix.T, rtol=1e-12)


def consistent_and_free(free_spread):
    """Three phones: b differs from a by 1 in parameter 0, which is always kept; c by 1 in 1, which varies freely."""
    stream = np.random.default_rng(6)
    phone = np.repeat([0, 1, 2], 200)
    samples = np.zeros((600, 1, 2))
    samples[:, 0, 0] = (phone == 1) + stream.normal(0, 0.1, 600)
    samples[:, 0, 1] = (phone == 2) + stream.normal(0, free_spread, 600)
    return phone_similarity(samples, phone, ("a", "b", "c"), np.ones(2))


def test_a_parameter_that_coarticulation_moves_freely_counts_little():
    matrix = consistent_and_free(1.0).matrix
    assert matrix[0, 2] > 0.6
    assert matrix[0, 1] < 0.2
    alike = consistent_and_free(0.1).matrix
    assert alike[0, 2] == pytest.approx(alike[0, 1], abs=0.02)


def test_a_parameter_that_moves_the_face_more_counts_more():
    phone = np.array([0, 1, 2])
    samples = np.array([[[0.0, 0.0]], [[10.0, 0.0]], [[0.0, 1.0]]])  # one spread apart, in millimetres of unlike size
    matrix = phone_similarity(samples, phone, ("a", "b", "c"), np.array([10.0, 1.0])).matrix
    assert matrix[0, 1] < matrix[0, 2]


def test_ranks_the_nearest_phones():
    samples = np.array([0.0, 1.0, 5.0]).reshape(3, 1, 1)
    found = phone_similarity(samples, np.arange(3), ("m", "p", "i"), np.ones(1))
    assert [phone for phone, _ in found.nearest("m")] == ["p", "i"]


def test_an_unrecorded_phone_is_similar_to_itself_only():
    matrix = phone_similarity(np.zeros((2, 1, 1)), np.array([0, 0]), ("a", "b"), np.ones(1)).matrix
    assert matrix.tolist() == [[1.0, 0.0], [0.0, 1.0]]


def test_refuses_what_does_not_fit():
    with pytest.raises(InputError, match="do not fit"):
        phone_similarity(np.zeros((2, 1, 3)), np.array([0, 0]), ("a",), np.ones(2))
    with pytest.raises(InputError, match="number 1 is not"):
        phone_similarity(np.zeros((2, 1, 2)), np.array([0, 0]), ("a",), np.array([1.0, 0.0]))
