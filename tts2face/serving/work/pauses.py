"""Pauses of the DBOS engine of a worker that has nothing to do.

DBOS polls each queue at a fixed interval, with about ten statements each time, whether there is work or not: 5 % of a
core in a worker that waits. Here one short statement each time finds out whether work waits, and the engine sleeps
until it does (decision 083). No result depends on it: the engine also wakes every `IDLE_S` seconds.
"""

import random
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any

AWAKE_S = 2.0  # after work was found or done, in which the engine polls for itself
IDLE_S = 30.0  # between two polls of the engine while no work is found


class EnginePauses:
    """Replaces the pauses of the threads of a launched engine."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._n_busy = 0
        self._awake_until_s = time.monotonic() + AWAKE_S

    def install(self, engine: Any) -> None:
        """Replace the waiting of the engine's threads; those of its other pauses stay."""
        # DBOS 3.4 has no public pause. The event of the background jobs is private; they ask twice a second.
        for stopped in (*engine.background_thread_stop_events, engine._background_jobs_stop_event):
            stopped.wait = partial(self._pause, stopped.wait, stopped.is_set)

    @property
    def is_awake(self) -> bool:
        """Whether the engine polls for itself: this worker is at work, or work was found a moment ago."""
        return self._n_busy > 0 or time.monotonic() < self._awake_until_s

    def wake(self) -> None:
        """Let the engine poll its queues now: work may wait there."""
        with self._changed:
            self._awake_until_s = time.monotonic() + AWAKE_S
            self._changed.notify_all()

    @contextmanager
    def busy(self) -> Iterator[None]:
        """Keep the engine awake within the context and a moment longer: the place that becomes free is to be filled."""
        with self._changed:
            self._n_busy += 1
        try:
            yield
        finally:
            with self._changed:
                self._n_busy -= 1
            self.wake()

    def _pause(self, wait: Callable[[float], bool], is_stopped: Callable[[], bool], timeout: float) -> bool:
        """Wait as the engine asks for, or longer while nothing is to be done; whether the engine has been stopped."""
        if self.is_awake or timeout >= IDLE_S:
            return wait(timeout)
        with self._changed:
            self._changed.wait_for(lambda: self.is_awake or is_stopped(), IDLE_S)
        return wait(random.uniform(0.0, 0.25 * min(timeout, 1.0)))  # all workers wake at the same time
