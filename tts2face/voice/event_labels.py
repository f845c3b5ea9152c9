"""Labels of the phones that a voice was given, for the times of the sounds that it reports."""

from collections.abc import Sequence

import numpy as np

from lexicon.phones import phone_distance


def match_phones(given: Sequence[str], reported: Sequence[str]) -> tuple[tuple[int, int], ...]:
    """Cheapest monotone matching of given phones with reported ones, each with at least one.

    A formant synthesiser reports its own variants (a flap for /t/), splits phones (ɝ as ɜ ɹ) and joins them (l ɹ).

    Parameters
    ----------
    given, reported
        N and M phones of the table, at least one each.

    Returns
    -------
    pairs of indices
        From (0, 0) to (N - 1, M - 1), neither falling.
    """
    cost = np.array([[_cost(own, other) for other in reported] for own in given])
    total = np.full((len(given) + 1, len(reported) + 1), np.inf)
    total[0, 0] = 0.0
    for i in range(len(given)):
        for k in range(len(reported)):
            total[i + 1, k + 1] = cost[i, k] + min(total[i, k], total[i, k + 1], total[i + 1, k])
    i, k = len(given) - 1, len(reported) - 1
    path = [(i, k)]
    while (i, k) != (0, 0):
        steps = [(total[i, k], i - 1, k - 1), (total[i, k + 1], i - 1, k), (total[i + 1, k], i, k - 1)]
        _, i, k = min(step for step in steps if step[1] >= 0 and step[2] >= 0)
        path.append((i, k))
    return tuple(reversed(path))


def _cost(given: str, reported: str) -> float:
    """Distance of two phones; none between a rhotic vowel and the ɹ that is reported as its second half."""
    return 0.0 if given in {"ɝ", "ɚ"} and reported == "ɹ" else phone_distance(given, reported)


def given_starts(given: Sequence[str], reported: Sequence[str], starts: Sequence[float], end: float) -> list[float]:
    """Start in seconds of each given phone, from the starts of the reported phones and the end of the last.

    Given phones that share a reported one divide its time equally.
    """
    path = match_phones(given, reported)
    ends = [*starts[1:], end]
    found = []
    for number in range(len(given)):
        first = next(k for i, k in path if i == number)
        sharers = [i for i, k in path if k == first]
        share = sharers.index(number) / len(sharers)
        found.append(starts[first] + share * (ends[first] - starts[first]))
    for number in reversed(range(1, len(found))):
        following = found[number + 1] if number + 1 < len(found) else end
        if found[number] >= following:  # reported without duration (the l of bottle): half of the phone before it
            found[number] = (found[number - 1] + following) / 2
    return found
