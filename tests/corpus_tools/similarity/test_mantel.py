"""The Mantel test against every permutation of a small table."""

from itertools import permutations

import numpy as np
import pytest

from corpus_tools.studies.similarity.mantel import articulatory_distances, mantel, shuffled_correlations, upper_triangle
from lexicon.errors import InputError
from lexicon.phones import phone_distance


def symmetric(seed, n):
    matrix = np.random.default_rng(seed).uniform(size=(n, n))
    matrix = (matrix + matrix.T) / 2
    np.fill_diagonal(matrix, 0.0)
    return matrix


def slow_r(first, second, order):
    pairs = [(i, j) for i in range(len(first)) for j in range(i + 1, len(first))]
    return np.corrcoef([first[i, j] for i, j in pairs], [second[order[i], order[j]] for i, j in pairs])[0, 1]


def test_p_is_the_share_of_all_permutations():
    first = symmetric(1, 5)
    second = first + 0.5 * symmetric(2, 5)
    every = [slow_r(first, second, order) for order in permutations(range(5))]
    share = np.mean(np.array(every) >= every[0] - 1e-12)
    found = mantel(first, second, np.random.default_rng(0), 4000)
    assert found.r == pytest.approx(every[0], rel=1e-12)
    assert found.n_pairs == 10
    assert found.p == pytest.approx(share, abs=4 * np.sqrt(share * (1 - share) / 4000) + 1 / 4000)  # 4 standard errors


def test_shuffled_correlations_are_those_of_numpy():
    first, second = symmetric(3, 6), symmetric(4, 6)
    orders = np.array(list(permutations(range(6)))[::37])
    expected = [slow_r(first, second, order) for order in orders]
    np.testing.assert_allclose(shuffled_correlations(first, second, orders), expected, rtol=1e-9, atol=1e-12)


def test_a_table_agrees_with_itself_as_no_shuffle_does():
    table = symmetric(5, 9)
    found = mantel(table, table, np.random.default_rng(0), 999)
    assert found.r == pytest.approx(1.0)
    assert found.p == 1 / 1000


def test_unrelated_tables_are_not_significant_more_often_than_chance():
    p = [mantel(symmetric(2 * k, 8), symmetric(2 * k + 1, 8), np.random.default_rng(k), 199).p for k in range(100, 200)]
    assert np.mean(np.array(p) <= 0.05) <= 0.13  # 0.05 and four standard errors of 100 tries
    assert np.mean(p) == pytest.approx(0.5, abs=0.12)


def test_the_same_seed_gives_the_same_p():
    a, b = symmetric(1, 7), symmetric(2, 7)
    assert mantel(a, b, np.random.default_rng(4), 99) == mantel(a, b, np.random.default_rng(4), 99)


def test_the_upper_triangle_is_without_the_diagonal():
    assert upper_triangle(np.arange(9).reshape(3, 3)).tolist() == [1, 2, 5]


def test_articulatory_distances_are_the_phone_table_s():
    found = articulatory_distances(("p", "b", "a"))
    assert found[0, 2] == found[2, 0] == phone_distance("p", "a")
    assert (np.diag(found) == 0).all()
    assert found[0, 1] < found[0, 2]


def test_refuses_tables_of_different_phones():
    with pytest.raises(InputError, match=r"the same 3 items or more, not \(4, 4\) and \(5, 5\)"):
        mantel(symmetric(1, 4), symmetric(1, 5), np.random.default_rng(0))


def test_refuses_a_table_of_equals():
    with pytest.raises(InputError, match="all pairs of a table have the same value"):
        mantel(symmetric(1, 4), np.ones((4, 4)), np.random.default_rng(0), 9)
