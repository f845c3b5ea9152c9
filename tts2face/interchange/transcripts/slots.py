"""Instants of annotations that have no time of their own, between those that have one."""

from collections.abc import Sequence


def interpolated(times: Sequence[float | None]) -> list[float]:
    """Instants in order, of which each run without times is divided evenly between its neighbours.

    At an end, where only one neighbour has a time, the run lies there; without any time all is 0.
    """
    known = [at for at, time in enumerate(times) if time is not None]
    filled = []
    for at, time in enumerate(times):
        before = max((place for place in known if place <= at), default=None)
        after = min((place for place in known if place >= at), default=None)
        if time is not None:
            filled.append(time)
        elif before is None or after is None:
            nearest = after if before is None else before
            filled.append(0.0 if nearest is None else float(times[nearest] or 0.0))
        else:
            first, last = float(times[before] or 0.0), float(times[after] or 0.0)
            filled.append(first + (last - first) * (at - before) / (after - before))
    return filled
