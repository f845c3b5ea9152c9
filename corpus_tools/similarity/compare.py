"""Comparison of two talkers' similarity tables."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from corpus_tools.similarity.mantel import Agreement, mantel
from corpus_tools.similarity.tokens import LEAST_PHONES, SimilarityTable
from lexicon.errors import InputError


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """Comparison of two tables over their P common phones.

    ``difference`` (P, P) is the first talker's similarity minus the other's; ``per_phone`` (P,) the mean size of a
    phone's differences; ``left_out`` are phones of one talker only.
    """

    other: str
    phones: tuple[str, ...]
    difference: NDArray[np.float64]
    per_phone: NDArray[np.float64]
    agreement: Agreement
    left_out: tuple[str, ...]

    def largest_differences(self, n: int = 10) -> list[tuple[str, str, float]]:
        """The n pairs that differ most: phone, phone, difference."""
        rows, columns = np.triu_indices(len(self.phones), 1)
        sizes = self.difference[rows, columns]
        order = np.argsort(-np.abs(sizes), kind="stable")[:n]
        return [(self.phones[rows[at]], self.phones[columns[at]], float(sizes[at])) for at in order]


def compare_tables(one: SimilarityTable, two: SimilarityTable, other: str, stream: np.random.Generator) -> Comparison:
    """Compare two talkers' tables; `other` is the second one's name.

    Raises
    ------
    InputError
        They have fewer than `LEAST_PHONES` phones in common.
    """
    common = tuple(phone for phone in one.phones if phone in two.phones)
    if len(common) < LEAST_PHONES:
        raise InputError(
            f"the talkers have {len(common)} phones in common; a comparison needs {LEAST_PHONES}; choose another talker"
        )
    a, b = _select_phones(one, common), _select_phones(two, common)
    difference = a - b
    per_phone = np.abs(difference).sum(axis=1) / (len(common) - 1)
    apart = sorted({*one.phones, *two.phones} - set(common))
    return Comparison(other, common, difference, per_phone, mantel(a, b, stream), tuple(apart))


def _select_phones(table: SimilarityTable, phones: tuple[str, ...]) -> NDArray[np.float64]:
    at = [table.phones.index(phone) for phone in phones]
    return table.matrix[np.ix_(at, at)]
