"""Stages of a request, such as waiting for a process: for the header Server-Timing and for traces."""

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass

MAX_STAGES = 200  # of a request that are kept; a WebSocket may have any number


@dataclass(slots=True)
class Stage:
    """A part of the time of a request; its bounds in seconds of the monotonic clock."""

    name: str
    begin: float
    end: float | None = None


STAGES: ContextVar[list[Stage] | None] = ContextVar("stages", default=None)


@contextmanager
def stage(name: str) -> Iterator[None]:
    """Record the time of a block as a stage of the present request; without a request, nothing is recorded."""
    stages, new = STAGES.get(), Stage(name, time.monotonic())
    if stages is not None and len(stages) < MAX_STAGES:
        stages.append(new)
    try:
        yield
    finally:
        new.end = time.monotonic()


def durations(stages: Sequence[Stage], now: float) -> dict[str, float]:
    """Seconds of each name; a stage that has not ended counts up to `now`."""
    found: dict[str, float] = {}
    for spent in stages:
        found[spent.name] = found.get(spent.name, 0.0) + (now if spent.end is None else spent.end) - spent.begin
    return found
