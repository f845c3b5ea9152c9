"""Units of a text that a recording covers: phones, and triphones by the visemes of their three phones.

Greedy selection of sentences by the units that they add.
"""

import heapq
from collections import Counter
from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from lexicon.phones import SILENCE, look_up_phone
from lexicon.pronounce import pronounce
from tts2face.interchange.exports.visemes import viseme_table

INVENTORY = "oculus"  # visemes, a class of every phone of the phone table; 15 with silence
Triphone = tuple[str, str, str]  # viseme before, visemes of the phone joined by "-", viseme behind
REPEATS = (8, 4, 2, 1)  # weight of the first, second, ... occurrence of a unit; further ones add nothing
PHONES_A_PROMPT = 25  # cost of a prompt beside its own phones: reading it and the pauses take about 2 s
PHONE_SHARE = 0.5  # weight of all phones together in units of that of all triphones


@dataclass(frozen=True, slots=True)
class Units:
    """Content of one sentence: its phones, and a triphone for each of them."""

    phones: tuple[str, ...]
    triphones: tuple[Triphone, ...]


@dataclass(frozen=True, slots=True)
class Coverage:
    """Phones and triphones that sentences cover.

    Parameters
    ----------
    n_phones, of_phones
        Phones that occur, and those of the running text.
    n_triphones, of_triphones
        Classes of triphones that occur, and those of the running text.
    share
        Of the triphones of running text, by their frequency, that belong to a class that occurs.
    """

    n_phones: int
    of_phones: int
    n_triphones: int
    of_triphones: int
    share: float


@dataclass(frozen=True, slots=True)
class RunningText:
    """How often each phone and each class of triphones occurs in running text."""

    phones: Mapping[str, int]
    triphones: Mapping[Triphone, int]

    def coverage(self, sentences: Iterable[Units]) -> Coverage:
        """Coverage of this text by sentences."""
        phones: set[str] = set()
        triphones: set[Triphone] = set()
        for units in sentences:
            phones.update(units.phones)
            triphones.update(units.triphones)
        covered = sum(n for triphone, n in self.triphones.items() if triphone in triphones)
        return Coverage(
            n_phones=len(phones & self.phones.keys()),
            of_phones=len(self.phones),
            n_triphones=len(triphones & self.triphones.keys()),
            of_triphones=len(self.triphones),
            share=covered / max(sum(self.triphones.values()), 1),
        )


def sentence_units(text: str, language: str) -> Units:
    """Units of a sentence; there is silence before it, behind it and at its marks."""
    phones: list[str] = [SILENCE]
    for word in pronounce(text, language).words:
        phones += [*word.phones, *([SILENCE] if word.mark else [])]
    if phones[-1] != SILENCE:
        phones.append(SILENCE)
    visemes = [viseme_table(INVENTORY)[look_up_phone(phone).symbol] for phone in phones]
    triphones = [
        (before[-1], "-".join(here), behind[0])
        for (before, here), (_, behind) in pairwise(pairwise(visemes))
        if here[0] != SILENCE
    ]
    return Units(tuple(phone for phone in phones if phone != SILENCE), tuple(triphones))


def count_units(sentences: Iterable[Units]) -> RunningText:
    """Counts of the units of sentences, in alphabetical order."""
    phones: Counter[str] = Counter()
    triphones: Counter[Triphone] = Counter()
    for units in sentences:
        phones.update(units.phones)
        triphones.update(units.triphones)
    # sorted, so that ties are chosen alike on each machine
    return RunningText(dict(sorted(phones.items())), dict(sorted(triphones.items())))


def select_sentences(candidates: Sequence[Units], running: RunningText) -> Iterator[int]:
    """Indices of candidates, each the one that adds most a second to those before, until none adds anything.

    Notes
    -----
    A triphone weighs as often as it occurs in running text, all phones weigh the same; repetitions weigh less
    (`REPEATS`). The sum is monotone and submodular, so that a greedy selection reaches at least 1 - 1/e of the best one
    of its size (Nemhauser, Wolsey and Fisher 1978), and a gain that was computed earlier bounds the present one:
    candidates are measured again only while they are the best (Minoux 1978). Equal gains go by the order.
    """
    weights = unit_weights(running)
    seen: Counter[Hashable] = Counter()
    heap = [(-_gain(units, seen, weights), at, 0) for at, units in enumerate(candidates)]
    heapq.heapify(heap)
    n_selected = 0
    while heap:
        gain, at, measured = heapq.heappop(heap)
        if measured != n_selected:
            # lazy greedy (Minoux 1978): a gain only falls; who is best of the heap is computed again
            heapq.heappush(heap, (-_gain(candidates[at], seen, weights), at, n_selected))
            continue
        if not gain:
            return
        yield at
        n_selected += 1
        seen.update(_units(candidates[at]))


def unit_weights(running: RunningText) -> dict[Hashable, int]:
    """Weight of each phone and each triphone, whole numbers."""
    n_phones = max(len(running.phones), 1)
    of_phone = max(1, round(PHONE_SHARE * sum(running.triphones.values()) / n_phones))
    weights: dict[Hashable, int] = dict.fromkeys(running.phones, of_phone)
    weights.update(running.triphones.items())
    return weights


def _gain(units: Units, seen: Counter[Hashable], weights: dict[Hashable, int]) -> float:
    """Weight that a sentence adds, for each phone of the time that it takes."""
    total = 0
    added: Counter[Hashable] = Counter()
    for unit in _units(units):
        times = seen[unit] + added[unit]
        added[unit] += 1
        if times < len(REPEATS):
            total += REPEATS[times] * weights.get(unit, 0)
    return total / (PHONES_A_PROMPT + len(units.phones))


def _units(units: Units) -> tuple[Hashable, ...]:
    return (*units.phones, *units.triphones)
