"""Analysis of a talker's phone similarity table.

Comparison of two talkers' similarity tables.
"""

from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from corpus_tools.studies.similarity.consistency import Consistency, mode_consistency, movement_consistency
from corpus_tools.studies.similarity.mantel import Agreement, articulatory_distances, mantel
from corpus_tools.studies.similarity.reliability import Reliability, split_half
from corpus_tools.studies.similarity.tables import (
    LEAST_PHONES,
    SimilarityTable,
    SpokenTokens,
    Tree,
    VisemeClasses,
    best_classes,
    check_classes,
    cluster_tree,
    collect_spoken_tokens,
    distances,
    similarity_table,
    viseme_classes,
)
from lexicon.errors import InputError
from lexicon.phones import look_up_phone
from lexicon.values.fields import check_fields
from tts2face.lips.similarity import PhoneSimilarity
from tts2face.models.talker import Talker
from tts2face.types import Progress, ignore_progress

USUAL_CLASSES = (4, 6, 8, 10, 12)
STREAMS = MappingProxyType(
    {"utterances": 0, "words": 1, "articulation": 2, "comparison": 3, "same phones": 4}
)  # each statistic has its own random stream
N_NEIGHBOURS = 3  # as in T07 Table 1


@dataclass(frozen=True, slots=True, eq=False)
class TableComparison:
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


def compare_tables(
    first: SimilarityTable, second: SimilarityTable, other: str, stream: np.random.Generator
) -> TableComparison:
    """Compare two talkers' tables; `other` is the second one's name."""
    common = tuple(phone for phone in first.phones if phone in second.phones)
    if len(common) < LEAST_PHONES:
        raise InputError(
            f"the talkers have {len(common)} phones in common; a comparison needs {LEAST_PHONES}; choose another talker"
        )
    a, b = _select_phones(first, common), _select_phones(second, common)
    difference = a - b
    per_phone = np.abs(difference).sum(axis=1) / (len(common) - 1)
    apart = sorted({*first.phones, *second.phones} - set(common))
    return TableComparison(other, common, difference, per_phone, mantel(a, b, stream), tuple(apart))


def _select_phones(table: SimilarityTable, phones: tuple[str, ...]) -> NDArray[np.float64]:
    at = [table.phones.index(phone) for phone in phones]
    return table.matrix[np.ix_(at, at)]


@dataclass(frozen=True, slots=True)
class SimilarityOptions:
    """Numbers of `classes` (None: `USUAL_CLASSES` below the number of phones), of random halves, and the seed."""

    classes: tuple[int, ...] | None = None
    halves: int = 20
    seed: int = 0

    def __post_init__(self) -> None:
        """Refuse values of other types (`InputError`)."""
        check_fields(self)


@dataclass(frozen=True, slots=True, eq=False)
class NamedTalker:
    """A talker and the name or path by which it was loaded."""

    name: str
    talker: Talker


@dataclass(frozen=True, slots=True, eq=False)
class Analysis:
    """All results on one talker's similarity table.

    ``curve`` holds classes for every number from 2 to P - 1, ``chosen`` those of the options, ``best`` the one with the
    highest silhouette. ``by_words`` is None if the corpus has too few different words; ``by_utterances_same_phones``
    compares the phones of ``by_words`` between halves of the utterances. ``articulation`` (P, P) are articulatory
    distances of the phones, ``articulatory`` their agreement with the table: all phones, consonants, vowels.
    """

    name: str
    n_utterances: int
    options: SimilarityOptions
    table: SimilarityTable
    neighbours: tuple[tuple[tuple[str, float], ...], ...]
    tree: Tree
    curve: tuple[VisemeClasses, ...]
    chosen: tuple[VisemeClasses, ...]
    best: VisemeClasses
    by_utterances: Reliability
    by_words: Reliability | None
    by_utterances_same_phones: Reliability | None
    articulation: NDArray[np.float64]
    articulatory: tuple[tuple[str, Agreement], ...]
    movements: Consistency
    modes: Consistency
    comparison: TableComparison | None


def analyse(
    subject: NamedTalker,
    options: SimilarityOptions,
    other: NamedTalker | None = None,
    on_progress: Progress = ignore_progress,
) -> Analysis:
    """Analyse a talker's similarity table, and compare it with another's.

    Raises
    ------
    InputError
        A talker has too few phones, tokens or utterances, the talkers too few common phones, or the number of classes
        or halves is impossible.
    """
    if options.halves < 2:
        raise InputError(f"a reliability needs at least 2 random halves, not {options.halves}")
    if options.seed < 0:
        raise InputError(f"a seed is a whole number from 0, not {options.seed}")
    spoken = collect_spoken_tokens(subject.talker, subject.name)
    table = similarity_table(spoken)
    numbers = _class_numbers(options, len(table.phones))
    against = None if other is None else similarity_table(collect_spoken_tokens(other.talker, other.name))
    distance = distances(table.matrix)
    tree = cluster_tree(distance)
    curve = tuple(viseme_classes(distance, tree, n) for n in range(2, len(table.phones)))
    by_utterances, by_words, same_phones = _split_halves(spoken, options, on_progress)
    if by_utterances is None:
        raise InputError(f"halves of {subject.name}'s utterances have too few phones in common; record more")
    similarity = PhoneSimilarity(table.phones, table.matrix)
    articulation = articulatory_distances(table.phones)
    return Analysis(
        subject.name,
        len(subject.talker.utterances),
        options,
        table,
        tuple(tuple(similarity.nearest(phone, N_NEIGHBOURS)) for phone in table.phones),
        tree,
        curve,
        tuple(viseme_classes(distance, tree, n) for n in numbers),
        best_classes(curve),
        by_utterances,
        by_words,
        same_phones,
        articulation,
        _articulatory_agreement(table.phones, distance, articulation, options),
        movement_consistency(spoken, table.phones, subject.talker.model),
        mode_consistency(spoken, table.phones, subject.talker.model),
        _compare(table, against, other, options),
    )


def _class_numbers(options: SimilarityOptions, n_phones: int) -> tuple[int, ...]:
    if options.classes is None:
        return tuple(n for n in USUAL_CLASSES if n < n_phones)
    for n in options.classes:
        check_classes(n, n_phones)
    return tuple(sorted(set(options.classes)))


def _split_halves(
    tokens: SpokenTokens, options: SimilarityOptions, on_progress: Progress
) -> tuple[Reliability | None, Reliability | None, Reliability | None]:
    """Reliability by utterances, by words, and by utterances over the phones compared by words."""
    n, done = options.halves, 0

    def step() -> None:
        nonlocal done
        done += 1
        on_progress(done, 3 * n)

    by_utterances = split_half(tokens, tokens.utterance, n, _stream(options, "utterances"), on_half=step)
    by_words = split_half(tokens, tokens.word, n, _stream(options, "words"), on_half=step)
    if by_words is None:
        return by_utterances, None, None
    among = set(by_words.phones) - set(by_words.left_out)
    stream = _stream(options, "same phones")
    return by_utterances, by_words, split_half(tokens, tokens.utterance, n, stream, among=among, on_half=step)


def _articulatory_agreement(
    phones: tuple[str, ...],
    distance: NDArray[np.float64],
    articulation: NDArray[np.float64],
    options: SimilarityOptions,
) -> tuple[tuple[str, Agreement], ...]:
    """Agreement over all phones, and within consonants and vowels where there are `LEAST_PHONES` of them."""
    vowel = np.array([look_up_phone(phone).is_vowel for phone in phones])
    stream = _stream(options, "articulation")
    agreements = []
    for name, kept in (("all phones", vowel | True), ("consonants", ~vowel), ("vowels", vowel)):
        at = np.flatnonzero(kept)
        if len(at) >= LEAST_PHONES:
            agreements.append((name, mantel(distance[np.ix_(at, at)], articulation[np.ix_(at, at)], stream)))
    return tuple(agreements)


def _compare(
    table: SimilarityTable, against: SimilarityTable | None, other: NamedTalker | None, options: SimilarityOptions
) -> TableComparison | None:
    if against is None or other is None:
        return None
    return compare_tables(table, against, other.name, _stream(options, "comparison"))


def _stream(options: SimilarityOptions, name: str) -> np.random.Generator:
    return np.random.default_rng([options.seed, STREAMS[name]])
