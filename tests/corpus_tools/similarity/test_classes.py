"""Classes and silhouettes against hand-computed values and a brute-force version; a block matrix gives its blocks."""

import numpy as np
import pytest

from corpus_tools.studies.similarity.tables import (
    VisemeClasses,
    best_classes,
    cluster_tree,
    cut_into_classes,
    distances,
    silhouettes,
    viseme_classes,
)
from lexicon.errors import InputError

# Four points on a line at 0, 1, 5, 7, in two classes.
LINE = np.abs(np.subtract.outer([0.0, 1.0, 5.0, 7.0], [0.0, 1.0, 5.0, 7.0]))


@pytest.mark.needs("sklearn")
def test_silhouettes_of_four_points_on_a_line_by_hand():
    # point 0: a = 1, b = (5 + 7) / 2 = 6; point 1: a = 1, b = 5; point 5: a = 2, b = 4.5; point 7: a = 2, b = 6.5
    found = silhouettes(LINE, np.array([0, 0, 1, 1]))
    np.testing.assert_allclose(found, [5 / 6, 4 / 5, 2.5 / 4.5, 4.5 / 6.5], rtol=1e-12)


@pytest.mark.needs("sklearn")
def test_a_phone_alone_has_silhouette_zero_and_a_misplaced_one_is_negative():
    found = silhouettes(LINE, np.array([0, 1, 1, 2]))
    assert found[0] == found[3] == 0.0
    # point 1 with point 5: a = 4, nearest other class is point 0 at 1
    assert found[1] == pytest.approx((1 - 4) / 4)


def slow_silhouette(distance, labels, item):
    own = [j for j in range(len(labels)) if labels[j] == labels[item] and j != item]
    if not own:
        return 0.0
    a = sum(distance[item][j] for j in own) / len(own)
    b = min(
        sum(distance[item][j] for j in range(len(labels)) if labels[j] == other) / list(labels).count(other)
        for other in set(labels) - {labels[item]}
    )
    return (b - a) / max(a, b)


@pytest.mark.needs("sklearn")
def test_silhouettes_follow_the_definition():
    stream = np.random.default_rng(3)
    points = stream.normal(size=(12, 2))
    distance = np.linalg.norm(points[:, None] - points[None], axis=2)
    labels = stream.integers(0, 4, 12)
    expected = [slow_silhouette(distance, labels.tolist(), item) for item in range(12)]
    np.testing.assert_allclose(silhouettes(distance, labels), expected, rtol=1e-12)


@pytest.mark.needs("sklearn")
def test_items_at_one_place_have_no_silhouette():
    assert silhouettes(np.zeros((4, 4)), np.array([0, 0, 1, 1])).tolist() == [0.0] * 4


def block_similarity():
    """Items 0, 3, 6 alike, then 1, 4, 7, then 2, 5."""
    block = np.arange(8) % 3
    matrix = np.where(block[:, None] == block[None], 0.9, 0.2)
    np.fill_diagonal(matrix, 1.0)
    return matrix, block


@pytest.mark.needs("sklearn")
def test_a_block_matrix_gives_its_blocks():
    matrix, block = block_similarity()
    distance = distances(matrix)
    tree = cluster_tree(distance)
    labels = cut_into_classes(tree, 3)
    assert all((labels[i] == labels[j]) == (block[i] == block[j]) for i in range(8) for j in range(8))
    curve = tuple(viseme_classes(distance, tree, n) for n in range(2, 8))
    assert best_classes(curve).n_classes == 3
    assert best_classes(curve).silhouette == pytest.approx((0.8 - 0.1) / 0.8)


def test_a_cut_gives_exactly_so_many_classes_numbered_along_the_dendrogram():
    stream = np.random.default_rng(8)
    matrix = stream.uniform(size=(9, 9))
    tree = cluster_tree(distances((matrix + matrix.T) / 2))
    for n in range(2, 10):
        labels = cut_into_classes(tree, n)[tree.order]
        assert labels[0] == 0
        assert labels[-1] == n - 1
        assert set(np.diff(labels)) <= {0, 1}


def test_each_cut_splits_one_class_of_the_one_before():
    matrix = np.random.default_rng(5).uniform(size=(9, 9))
    tree = cluster_tree(distances((matrix + matrix.T) / 2))
    for n in range(2, 9):
        coarse, fine = cut_into_classes(tree, n), cut_into_classes(tree, n + 1)
        assert all(len(set(coarse[fine == label])) == 1 for label in range(n + 1))


def test_of_equal_silhouettes_the_fewest_classes_are_best():
    few, many = (VisemeClasses(np.array(labels), np.zeros(3)) for labels in ([0, 0, 1], [0, 1, 2]))
    assert best_classes((many, few)) is few


@pytest.mark.parametrize("n", [1, 9])
def test_refuses_numbers_of_classes_that_phones_cannot_make(n):
    matrix, _ = block_similarity()
    with pytest.raises(InputError, match=f"8 phones cannot make {n} classes; give a number from 2 to 8"):
        cut_into_classes(cluster_tree(distances(matrix)), n)


def test_refuses_a_silhouette_of_one_class():
    with pytest.raises(InputError, match="needs two classes"):
        silhouettes(LINE, np.zeros(4, int))
