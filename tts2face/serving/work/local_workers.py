"""Workers on this machine as child processes, which are started again when they end."""

import os
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field

from lexicon.errors import BackendError, Tts2faceError
from tts2face.processes.parent import Child
from tts2face.processes.program import Program
from tts2face.serving.batch.engine import OnMessage
from tts2face.serving.work.queues import WORK

WORKER = "tts2face.serving.work.worker:HANDLERS"
RESTART_S = 1.0  # after the death of a local worker
QUICK_END_S = 3.0  # after which a worker has begun its work; one that ends earlier cannot start
MAX_QUICK_ENDS = 6  # in a row, of all local workers


@dataclass(frozen=True, slots=True)
class LocalWorkers:
    """Workers of a database on this machine.

    Parameters
    ----------
    store_url
        Store as they open it.
    on_message
        Called with lines for people; in other threads.
    niceness
        What is added to their niceness: 10 yields to other processes.
    signing
        Arguments of the `Credentials` with which they sign results; None: they do not.
    """

    database: str
    store_url: str
    n_workers: int = 1
    on_message: OnMessage = lambda _: None
    niceness: int = 0
    signing: Mapping[str, str] | None = field(default=None, repr=False)


@contextmanager
def local_workers(wanted: LocalWorkers) -> Iterator[Callable[[], int]]:
    """Workers on this machine; the value starts those that have ended or have not been started, and counts the rest."""
    workers = _Supervisor(wanted)
    try:
        yield workers.supervise
    finally:
        workers.end()


class LocalWorker:
    """A worker as a child process, which ends with this one: a call that lasts as long as the worker.

    Attributes
    ----------
    began
        Second of the clock.
    reason
        Why it ended; empty while it works.
    """

    def __init__(self, wanted: LocalWorkers, core: int | None) -> None:
        self.began, self.reason = time.monotonic(), ""
        self._wanted, self._core = wanted, core
        self._child = Child(Program(WORKER, core=core, niceness=wanted.niceness))
        threading.Thread(target=self._work, name="worker", daemon=True).start()

    def end(self) -> None:
        """End the worker at once."""
        self._child.close()

    def _work(self) -> None:
        order = {"database": self._wanted.database, "store": self._wanted.store_url, "core": self._core,
                 "signing": self._wanted.signing}  # fmt: skip
        try:
            self._child.call(WORK, order, on_event=lambda event: self._wanted.on_message(event.content["line"]))
        except Tts2faceError as ended:
            self.reason = str(ended)


class _Supervisor:
    """Workers that are started again when they end."""

    def __init__(self, wanted: LocalWorkers) -> None:
        self._wanted = wanted
        self._cores = sorted(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else []
        self._workers: dict[int, LocalWorker] = {}
        self._n_quick = 0

    def supervise(self) -> int:
        """Start the workers that do not run; the number of those that do.

        After one that could not start, those that have just been started do not count.
        """
        n_alive = 0
        for number in range(self._wanted.n_workers):
            worker = self._workers.get(number)
            if worker is not None:
                lived_s = time.monotonic() - worker.began
                # one that has just ended waits, so that a lasting fault does not start processes all the time
                if not worker.reason or lived_s < RESTART_S:
                    n_alive += not worker.reason and (lived_s >= QUICK_END_S or not self._n_quick)
                    continue
                self._note_end(number, worker, lived_s)
            is_bound = self._wanted.n_workers > 1 and len(self._cores) > 0
            # more workers than cores share them
            core = self._cores[number % len(self._cores)] if is_bound else None
            self._workers[number] = LocalWorker(self._wanted, core)
        return n_alive

    def end(self) -> None:
        """End all workers."""
        for worker in self._workers.values():
            worker.end()

    def _note_end(self, number: int, worker: LocalWorker, lived_s: float) -> None:
        worker.end()
        self._wanted.on_message(f"worker {number + 1}: {worker.reason}; it is started again")
        self._n_quick = self._n_quick + 1 if lived_s < QUICK_END_S else 0
        if self._n_quick >= MAX_QUICK_ENDS:
            raise BackendError("the workers end as soon as they start; see their messages above")
