"""Instants of annotations that have no time of their own, between those that have one."""

from collections.abc import Sequence
from itertools import accumulate


def interpolated(times: Sequence[float | None]) -> list[float]:
    """Instants in order, of which each run without times is divided evenly between its neighbours.

    At an end, where only one neighbour has a time, the run lies there; without any time all is 0.
    """
    befores = list(accumulate((at if time is not None else None for at, time in enumerate(times)), _latest))
    from_behind = ((at if times[at] is not None else None) for at in reversed(range(len(times))))
    afters = list(accumulate(from_behind, _latest))[::-1]
    filled = []
    for at, (time, before, after) in enumerate(zip(times, befores, afters, strict=True)):
        if time is not None:
            filled.append(time)
        elif before is None or after is None:
            nearest = after if before is None else before
            filled.append(0.0 if nearest is None else float(times[nearest] or 0.0))
        else:
            first, last = float(times[before] or 0.0), float(times[after] or 0.0)
            filled.append(first + (last - first) * (at - before) / (after - before))
    return filled


def _latest(before: int | None, place: int | None) -> int | None:
    return before if place is None else place
