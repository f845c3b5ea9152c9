"""Mantel test: the agreement of two tables over the same items."""

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from lexicon.phones import phone_distance
from tts2face.lips.motion_measures import pearson

N_PERMUTATIONS = 9999


@dataclass(frozen=True, slots=True)
class Agreement:
    """Correlation `r` of two tables over their pairs, and its one-sided permutation p-value `p`."""

    r: float
    p: float
    n_permutations: int
    n_pairs: int


def upper_triangle(matrix: NDArray[np.floating]) -> NDArray[np.float64]:
    """(P (P - 1) / 2,) values above the diagonal, row by row."""
    return np.asarray(matrix[np.triu_indices(len(matrix), 1)], np.float64)


def mantel(
    first: NDArray[np.floating],
    second: NDArray[np.floating],
    stream: np.random.Generator,
    n_permutations: int = N_PERMUTATIONS,
) -> Agreement:
    """Correlation of two symmetric (P, P) tables, one-sided against shuffles of the second's items.

    Notes
    -----
    Pearson over the upper triangles; ``p = (1 + shuffles with at least this r) / (1 + shuffles)`` (Mantel 1967).
    """
    if first.shape != second.shape or len(first) < 3:
        raise InputError(
            f"the test needs two square tables over the same 3 items or more, not {first.shape} and {second.shape}"
        )
    orders = np.array([stream.permutation(len(first)) for _ in range(n_permutations)])
    found = pearson(upper_triangle(first), upper_triangle(second))
    if np.isnan(found):
        raise InputError(
            "all pairs of a table have the same value, so that no correlation is defined; compare other tables"
        )
    # an order that leaves all as it is must count, whatever the rounding of its sum
    as_high = shuffled_correlations(first, second, orders) >= found - 1e-12
    return Agreement(found, (1 + int(as_high.sum())) / (1 + n_permutations), n_permutations, len(upper_triangle(first)))


def shuffled_correlations(
    first: NDArray[np.floating], second: NDArray[np.floating], orders: NDArray[np.integer]
) -> NDArray[np.float64]:
    """(K,) correlation of the tables' upper triangles for K orders (K, P) of the second's items."""
    rows, columns = np.triu_indices(len(first), 1)
    fixed = _standardize(upper_triangle(first))
    moved = np.stack([second[order[rows], order[columns]] for order in orders])
    return np.asarray(_standardize(moved) @ fixed / len(rows))


def _standardize(values: NDArray[np.floating]) -> NDArray[np.float64]:
    offsets = values - values.mean(axis=-1, keepdims=True)
    return np.asarray(offsets / np.sqrt(np.square(offsets).mean(axis=-1, keepdims=True)))


def articulatory_distances(phones: tuple[str, ...]) -> NDArray[np.float64]:
    """(P, P) distance of the phones by their articulatory features (`lexicon.phones.phone_distance`)."""
    distance = np.zeros((len(phones), len(phones)))
    for a, b in combinations(range(len(phones)), 2):
        distance[a, b] = distance[b, a] = phone_distance(phones[a], phones[b])
    return distance
