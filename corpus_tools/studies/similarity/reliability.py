"""Split-half reliability of a similarity table."""

from collections.abc import Callable, Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from corpus_tools.studies.similarity.mantel import upper_triangle
from corpus_tools.studies.similarity.tables import (
    LEAST_PHONES,
    LEAST_TOKENS,
    SimilarityTable,
    SpokenTokens,
    similarity_table,
)
from lexicon.errors import InputError
from tts2face.lips.motion_measures import pearson
from tts2face.types import keep_on


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
    on_half: Callable[[], None] = keep_on,
) -> Reliability | None:
    """Agreement of tables from random halves of the `units` (N,): utterances or words of the tokens.

    All tokens of a unit are in the same half; tokens of units below 0 are in none. A phone is compared if each half has
    `LEAST_TOKENS` of it and it is in `among` (default: all). Splits with fewer than `LEAST_PHONES` such phones are
    dropped; the result is None if all are. `on_half` is called after each split.
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
        on_half()
        enough = is_included & (np.minimum(tables[0].counts, tables[1].counts) >= LEAST_TOKENS)
        # a half drew too few tokens; the others decide
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
