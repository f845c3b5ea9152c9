"""Mantel test: the agreement of two tables over the same items.

Split-half reliability of a similarity table.

Variation of mouth movements within phones: which movements each phone constrains.
"""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from itertools import combinations
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from corpus_tools.studies.similarity.tables import (
    LEAST_PHONES,
    LEAST_TOKENS,
    SimilarityTable,
    SpokenTokens,
    similarity_table,
)
from lexicon.errors import InputError
from lexicon.phones import phone_distance
from lexicon.sequence import SILENCE
from tts2face.lips.motion_measures import pearson
from tts2face.models.landmarks import (
    CHIN,
    LOWER_LIP_INNER_MID,
    MOUTH_CORNER_LEFT,
    MOUTH_CORNER_RIGHT,
    UPPER_LIP_INNER_MID,
)
from tts2face.models.talker import ShapeModel

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

    Raises
    ------
    InputError
        The tables differ in shape, have fewer than 3 items, or one of them is constant.

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


@dataclass(frozen=True, slots=True, eq=False)
class Reliability:
    """Agreement of tables from random halves.

    Parameters
    ----------
    correlations : (H,)
        Of the two tables' pairs, for each half that had enough phones.
    n_phones : (H,)
        Phones compared in each.
    phones, per_phone : P labels, (P,)
        Mean correlation of a phone's similarities to the others; NaN for a phone never compared.
    left_out
        Phones with too few tokens in every pair of halves.
    n_requested
        Number of random splits.
    """

    correlations: NDArray[np.float64]
    n_phones: NDArray[np.int64]
    phones: tuple[str, ...]
    per_phone: NDArray[np.float64]
    left_out: tuple[str, ...]
    n_requested: int

    @property
    def mean(self) -> float:
        """Mean correlation of two halves."""
        return float(self.correlations.mean())

    @property
    def full_length_reliability(self) -> float:
        """Reliability of the whole corpus, by the Spearman-Brown formula."""
        return spearman_brown(self.mean)


def spearman_brown(r: float) -> float:
    """Reliability of the whole from the correlation r of its halves: 2 r / (1 + r) (Spearman 1910, Brown 1910)."""
    return 2.0 * r / (1.0 + r)


def split_half(
    tokens: SpokenTokens,
    units: NDArray[np.integer],
    n_halves: int,
    stream: np.random.Generator,
    *,
    among: Collection[str] | None = None,
    on_half: Callable[[], None] | None = None,
) -> Reliability | None:
    """Agreement of tables from random halves of the `units` (N,): utterances or words of the tokens.

    All tokens of a unit are in the same half; tokens of units below 0 are in none. A phone is compared if each half has
    `LEAST_TOKENS` of it and it is in `among` (default: all). Splits with fewer than `LEAST_PHONES` such phones are
    dropped; the result is None if all are. `on_half` is called after each split.

    Raises
    ------
    InputError
        `n_halves` is below 2.
    """
    if n_halves < 2:
        raise InputError(f"a reliability needs at least 2 random halves, not {n_halves}")
    phones = similarity_table(tokens).phones
    is_included = np.array([among is None or phone in among for phone in phones])
    numbers = np.unique(units[units >= 0])
    rows, correlations, sizes = [], [], []
    for _ in range(n_halves):
        chosen = stream.permutation(numbers)[: len(numbers) // 2]
        first = np.isin(units, chosen)
        tables = similarity_table(tokens, first), similarity_table(tokens, ~first & (units >= 0))
        if on_half is not None:
            on_half()
        enough = is_included & (np.minimum(tables[0].counts, tables[1].counts) >= LEAST_TOKENS)
        if enough.sum() < LEAST_PHONES:
            continue
        row, r = _agreement(tables, enough)
        rows.append(row)
        correlations.append(r)
        sizes.append(int(enough.sum()))
    if not rows:
        return None
    per_phone = _nan_mean(np.array(rows))
    left_out = tuple(phone for phone, r in zip(phones, per_phone, strict=True) if np.isnan(r))
    return Reliability(np.array(correlations), np.array(sizes), phones, per_phone, left_out, n_halves)


def _agreement(
    tables: tuple[SimilarityTable, SimilarityTable], enough: NDArray[np.bool_]
) -> tuple[NDArray[np.float64], float]:
    """(P,) correlation of each phone's row, NaN for those not compared; and of all pairs."""
    kept = np.flatnonzero(enough)
    a, b = (table.matrix[np.ix_(kept, kept)] for table in tables)
    rows = np.full(len(enough), np.nan)
    for at, phone in enumerate(kept):
        others = np.arange(len(kept)) != at
        rows[phone] = pearson(a[at, others], b[at, others])
    return rows, pearson(upper_triangle(a), upper_triangle(b))


def _nan_mean(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    known = ~np.isnan(rows)
    n = known.sum(axis=0)
    return np.where(n > 0, np.where(known, rows, 0.0).sum(axis=0) / np.maximum(n, 1), np.nan)


UPPER_LIP, LOWER_LIP = 0, 17  # middle of the outer lip lines
X, Y, Z = range(3)
# A movement is a sum of landmark coordinates times factors, in mm: (landmark, axis, factor).
MOVEMENTS: Mapping[str, tuple[tuple[int, int, float], ...]] = MappingProxyType({
    "opening": ((UPPER_LIP_INNER_MID, Y, 1.0), (LOWER_LIP_INNER_MID, Y, -1.0)),
    "width": ((MOUTH_CORNER_LEFT, X, 1.0), (MOUTH_CORNER_RIGHT, X, -1.0)),
    "protrusion": (
        (UPPER_LIP, Z, 0.5), (LOWER_LIP, Z, 0.5), (MOUTH_CORNER_LEFT, Z, -0.5), (MOUTH_CORNER_RIGHT, Z, -0.5),
    ),
    "jaw lowering": ((CHIN, Y, -1.0),),
    "upper lip raise": ((UPPER_LIP, Y, 1.0),),
    "lower lip raise": ((LOWER_LIP, Y, 1.0), (CHIN, Y, -1.0)),
    "corner raise": ((MOUTH_CORNER_LEFT, Y, 0.5), (MOUTH_CORNER_RIGHT, Y, 0.5)),
    "sideways": ((MOUTH_CORNER_LEFT, X, 0.5), (MOUTH_CORNER_RIGHT, X, 0.5)),
})  # fmt: skip
LEAST_MM = 0.1  # modes with smaller movements at one standard deviation are named fine detail
N_NAMED = 2  # movements in a mode's name


@dataclass(frozen=True, slots=True, eq=False)
class Consistency:
    """Variation of K movements (or modes) within P phones.

    Parameters
    ----------
    names : K
    spread : (K,)
        Standard deviation over all tokens, mm (modes: mm over all landmarks together).
    free : (P, K)
        Standard deviation within the phone over that of all tokens: 0 constant, 1 as varied as all speech.
    free_share : (K,)
        Share of the variance that the phones do not explain: that of context and chance.
    """

    names: tuple[str, ...]
    spread: NDArray[np.float64]
    free: NDArray[np.float64]
    free_share: NDArray[np.float64]


def movement_weights(model: ShapeModel) -> NDArray[np.float64]:
    """(K, D) mm of each movement for one unit of each speech parameter."""
    basis = model.basis[: model.n_speech].astype(np.float64)
    return np.array(
        [sum(factor * basis[:, landmark, axis] for landmark, axis, factor in terms) for terms in MOVEMENTS.values()]
    )


def movement_consistency(tokens: SpokenTokens, phones: tuple[str, ...], model: ShapeModel) -> Consistency:
    """Variation of each of the `MOVEMENTS` within the phones."""
    return _consistency(tokens, phones, tokens.samples @ movement_weights(model).T, tuple(MOVEMENTS))


def mode_consistency(tokens: SpokenTokens, phones: tuple[str, ...], model: ShapeModel) -> Consistency:
    """Variation of each speech parameter within the phones, named by its largest movements."""
    return _consistency(tokens, phones, tokens.samples.astype(np.float64), mode_names(model))


def mode_names(model: ShapeModel) -> tuple[str, ...]:
    """Largest movements (mm) of each parameter at one standard deviation, as ``opening -4.6, jaw lowering -2.6``."""
    amounts = movement_weights(model) * model.spread[: model.n_speech]
    names, kinds = [], tuple(MOVEMENTS)
    for column in amounts.T:
        largest = [at for at in np.argsort(-np.abs(column), kind="stable")[:N_NAMED] if abs(column[at]) >= LEAST_MM]
        names.append(", ".join(f"{kinds[at]} {column[at]:+.1f}" for at in largest) or "fine detail")
    return tuple(names)


def _consistency(
    tokens: SpokenTokens, phones: tuple[str, ...], values: NDArray[np.floating], names: tuple[str, ...]
) -> Consistency:
    """Standard deviations within and over phones of (N, S, K) values, averaged over the samples."""
    sounding = tokens.phone != tokens.inventory.index(SILENCE)
    total = values[sounding].var(axis=0).mean(axis=0)
    within = np.zeros((len(phones), values.shape[2]))
    share = np.zeros(len(phones))
    for row, label in enumerate(phones):
        own = values[tokens.phone == tokens.inventory.index(label)]
        within[row] = own.var(axis=0).mean(axis=0)
        share[row] = len(own) / sounding.sum()
    whole = np.where(total > 0, total, 1.0)
    return Consistency(names, np.sqrt(total), np.sqrt(within / whole), share @ within / whole)
