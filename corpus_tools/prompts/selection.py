"""Greedy selection of sentences by the units that they add."""

import heapq
from collections import Counter
from collections.abc import Hashable, Iterator, Sequence

from corpus_tools.prompts.coverage import RunningText, Units

REPEATS = (8, 4, 2, 1)  # weight of the first, second, ... occurrence of a unit; further ones add nothing
PHONES_A_PROMPT = 25  # cost of a prompt beside its own phones: reading it and the pauses take about 2 s
PHONE_SHARE = 0.5  # weight of all phones together in units of that of all triphones


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
