"""An engine that queues segments in a database and waits for its workers.

Pauses of the engine of a worker that has nothing to do.

DBOS looks at each queue at a fixed interval, with about ten statements a look, whether there is work or not: 5 % of a
core in a worker that waits. Here one short statement a look finds out whether work waits, and the engine sleeps until
it does (decision 083). Nothing depends on the look for correctness: the engine also wakes every `IDLE_S` seconds.
"""

import os
import random
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from typing import Any

from lexicon.errors import BackendError, Tts2faceError
from tts2face.processes.parent import Child
from tts2face.processes.program import Program
from tts2face.serving.batch.engine import Message, Rendered
from tts2face.serving.batch.segment import Segment
from tts2face.serving.batch.store import Store, wait_for_store
from tts2face.serving.work.connection import DatabaseAwayError
from tts2face.serving.work.database import (
    APPLICATION,
    APPLICATION_VERSION,
    QUEUE,
    WORK,
    WORKFLOW,
    Workers,
    database_url,
    prepare_database,
)

WORKER = "tts2face.serving.work.worker:HANDLERS"
POLL_S = 0.5  # between two looks at the jobs that are awaited
JOBS_PER_QUERY = 500
ACTIVE = frozenset({"PENDING", "ENQUEUED", "DELAYED"})
RESTART_S = 1.0  # after the death of a local worker
QUICK_END_S = 3.0  # after which a worker has begun its work; one that ends earlier cannot start
MAX_QUICK_ENDS = 6  # in a row, of all local workers


@dataclass(frozen=True, slots=True)
class DatabaseEngine:
    """Queues segments for the workers of a database.

    Parameters
    ----------
    n_workers
        Workers started on this machine while the batch runs; with 0 only those of other machines work.
    store_url
        Store as the local workers open it.
    priority
        Jobs with smaller numbers are taken first; from 1.
    on_message
        Called with lines for people; in other threads with those of the local workers.
    on_wait
        Called at each look at the jobs; what it raises ends the waiting.
    niceness
        What is added to the niceness of the local workers: 10 yields to other processes.
    """

    database: str
    store_url: str
    n_workers: int = 1
    priority: int = 10
    on_message: Message = lambda _: None
    on_wait: Callable[[], None] = lambda: None
    niceness: int = 0

    def render(self, segments: Mapping[str, Segment], store: Store) -> Iterator[Rendered]:
        """Yield each segment as soon as it is stored or has failed."""
        if not segments:
            return
        url = database_url(self.database)
        prepare_database(url)
        with open_client(url) as client, Workers(url) as workers, local_workers(self) as supervise:
            look = _Look(client, enqueue(client, workers, segments, self.priority))
            if self.n_workers == 0 and not workers.alive():
                self.on_message("no worker is alive in this database; start `tts2face worker` with it")
            while look.waiting:
                supervise()
                self.on_wait()
                for address, reason in look.ended():
                    result = wait_for_store(partial(store.result, address), self.on_message)
                    yield Rendered(address, result, "" if result is not None else reason)
                if look.waiting:
                    time.sleep(POLL_S)


@dataclass(slots=True)
class _Look:
    """Looks at the jobs that are awaited, by their names: no clock says which of them have ended since the last look.

    Parameters
    ----------
    waiting
        Addresses by the names of their jobs, in the order in which they were queued.
    """

    client: Any
    waiting: dict[str, str]
    _next: int = 0  # place of the further part among those that wait

    def ended(self) -> list[tuple[str, str]]:
        """Addresses of the jobs that have ended, with the reason if there is no segment; each once.

        Of many jobs it looks at those that were queued first, which end first, and at one further part after the other.
        """
        names = list(self.waiting)
        found = self._found(names[:JOBS_PER_QUERY])
        if len(names) > JOBS_PER_QUERY:
            at = self._next if JOBS_PER_QUERY <= self._next < len(names) else JOBS_PER_QUERY
            found |= self._found(names[at : at + JOBS_PER_QUERY])
            self._next = at + JOBS_PER_QUERY
        reasons = {}
        for name, job in found.items():
            if job is None:
                reasons[name] = "its job was removed from the database; run again"
            elif job.status not in ACTIVE:
                reasons[name] = failure_reason(job)
        return [(self.waiting.pop(name), reason) for name, reason in reasons.items()]

    def _found(self, names: list[str]) -> dict[str, Any]:
        """Jobs by their names; None of one that is gone."""
        jobs = self.client.list_workflows(workflow_ids=names, load_input=False)
        return dict.fromkeys(names) | {one.workflow_id: one for one in jobs}


@contextmanager
def open_client(url: str) -> Iterator[Any]:
    """Client of a prepared database.

    Raises
    ------
    BackendError
        The database cannot be reached.
    """
    import sqlalchemy
    from dbos import DBOSClient

    try:
        client = DBOSClient(system_database_url=url, application_name=APPLICATION)
    except sqlalchemy.exc.SQLAlchemyError as away:
        raise DatabaseAwayError(f"the database cannot be reached ({away}); check its URL") from away
    try:
        yield client
    finally:
        client.destroy()


def enqueue(client: Any, workers: Workers, segments: Mapping[str, Segment], priority: int) -> dict[str, str]:
    """Queue segments; their addresses by the names of their jobs.

    The name of a job is the content address of its segment, so that two batches share it. A job that has ended without
    a stored segment is followed by a new one with the next number.
    """
    import sqlalchemy

    waiting: dict[str, str] = {}
    addresses = list(segments)
    for at in range(0, len(addresses), JOBS_PER_QUERY):
        numbers = dict.fromkeys(addresses[at : at + JOBS_PER_QUERY], 0)
        active = _skip_ended(client, numbers)
        names = {f"{address}.{number}": address for address, number in numbers.items()}
        waiting |= names
        missing = [(name, address) for name, address in names.items() if address not in active]
        jobs = [(_enqueue_options(name, priority), address, segments[address].as_json()) for name, address in missing]
        try:
            with workers.transaction() as connection:
                for job in jobs:
                    client.enqueue_in_transaction(connection, *job)
        except sqlalchemy.exc.DBAPIError:  # such as a deadlock with a batch of the same segments in another order
            for job in jobs:
                client.enqueue(*job)
    return waiting


def _enqueue_options(name: str, priority: int) -> dict[str, Any]:
    return {
        "queue_name": QUEUE,
        "workflow_name": WORKFLOW,
        "workflow_id": name,
        "app_version": APPLICATION_VERSION,
        "priority": priority,
    }


def _skip_ended(client: Any, numbers: dict[str, int]) -> set[str]:
    """Raise the numbers of jobs until none of them has ended; the addresses of those that are active."""
    active: set[str] = set()
    unknown = set(numbers)
    while unknown:
        names = [f"{address}.{numbers[address]}" for address in unknown]
        unknown = set()
        for one in client.list_workflows(workflow_ids=names, load_input=False, load_output=False):
            address = one.workflow_id.partition(".")[0]
            if one.status in ACTIVE:
                active.add(address)
            else:
                numbers[address] += 1
                unknown.add(address)
    return active


def failure_reason(job: Any) -> str:
    """Why a job has ended without a segment."""
    if job.status == "CANCELLED":
        return "cancelled"
    if job.status == "MAX_RECOVERY_ATTEMPTS_EXCEEDED":
        return "every worker that took it died; look at their memory and messages"
    if job.status == "SUCCESS":
        return "the store does not hold it; check that all workers use the same store"
    return " ".join(str(job.error).split()) or "unknown error"


@contextmanager
def local_workers(engine: DatabaseEngine) -> Iterator[Callable[[], int]]:
    """Workers on this machine; the value starts those that have ended or have not been started, and counts the rest."""
    workers = _LocalWorkers(engine)
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

    def __init__(self, engine: DatabaseEngine, core: int | None) -> None:
        self.began, self.reason = time.monotonic(), ""
        self._engine, self._core = engine, core
        self._child = Child(Program(WORKER, core=core, niceness=engine.niceness))
        threading.Thread(target=self._work, name="worker", daemon=True).start()

    def end(self) -> None:
        """End the worker at once."""
        self._child.close()

    def _work(self) -> None:
        order = {"database": self._engine.database, "store": self._engine.store_url, "core": self._core}
        try:
            self._child.call(WORK, order, on_event=lambda event: self._engine.on_message(event.content["line"]))
        except Tts2faceError as ended:
            self.reason = str(ended)


class _LocalWorkers:
    """Workers that are started again when they end."""

    def __init__(self, engine: DatabaseEngine) -> None:
        self._engine = engine
        self._cores = sorted(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else []
        self._workers: dict[int, LocalWorker] = {}
        self._n_quick = 0

    def supervise(self) -> int:
        """Start the workers that do not run; the number of those that do.

        After one that could not start, those that have just been started do not count.

        Raises
        ------
        BackendError
            They end as soon as they start.
        """
        n_alive = 0
        for number in range(self._engine.n_workers):
            worker = self._workers.get(number)
            if worker is not None:
                lived_s = time.monotonic() - worker.began
                if not worker.reason or lived_s < RESTART_S:
                    n_alive += not worker.reason and (lived_s >= QUICK_END_S or not self._n_quick)
                    continue
                self._note_end(number, worker, lived_s)
            is_bound = self._engine.n_workers > 1 and len(self._cores) > 0
            core = self._cores[number % len(self._cores)] if is_bound else None
            self._workers[number] = LocalWorker(self._engine, core)
        return n_alive

    def end(self) -> None:
        """End all workers."""
        for worker in self._workers.values():
            worker.end()

    def _note_end(self, number: int, worker: LocalWorker, lived_s: float) -> None:
        worker.end()
        self._engine.on_message(f"worker {number + 1}: {worker.reason}; it is started again")
        self._n_quick = self._n_quick + 1 if lived_s < QUICK_END_S else 0
        if self._n_quick >= MAX_QUICK_ENDS:
            raise BackendError("the workers end as soon as they start; see their messages above")


AWAKE_S = 2.0  # after work was found or done, in which the engine looks for itself
IDLE_S = 30.0  # between two looks of the engine while no work is found


class EnginePauses:
    """Replaces the pauses of the threads of a launched engine."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._n_busy = 0
        self._awake_until_s = time.monotonic() + AWAKE_S

    def install(self, engine: Any) -> None:
        """Replace the waiting of the engine's threads; those of its other pauses stay."""
        for stopped in (*engine.background_thread_stop_events, engine._background_jobs_stop_event):
            stopped.wait = partial(self._pause, stopped.wait, stopped.is_set)

    @property
    def is_awake(self) -> bool:
        """Whether the engine looks for itself: this worker is at work, or work was found a moment ago."""
        return self._n_busy > 0 or time.monotonic() < self._awake_until_s

    def wake(self) -> None:
        """Let the engine look at its queues now: work may wait there."""
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
