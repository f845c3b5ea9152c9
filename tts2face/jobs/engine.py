"""An engine that queues segments in a database and waits for its workers."""

import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from typing import Any

from lexicon.errors import BackendError
from tts2face.batch.engine import Message, Rendered
from tts2face.batch.segment import Segment
from tts2face.batch.store import Store, wait_for_store
from tts2face.jobs.database import APPLICATION, QUEUE, Workers, database_url, prepare_database
from tts2face.jobs.worker import APPLICATION_VERSION, WORKFLOW

POLL_S = 0.5  # between two looks at the jobs; longer for long lists
JOBS_PER_QUERY = 500
POLL_S_PER_JOB = 0.0005
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
    """

    database: str
    store_url: str
    n_workers: int = 1
    priority: int = 10
    on_message: Message = lambda _: None

    def render(self, segments: Mapping[str, Segment], store: Store) -> Iterator[Rendered]:
        """Yield each segment as soon as it is stored or has failed."""
        if not segments:
            return
        url = database_url(self.database)
        prepare_database(url)
        with open_client(url) as client, local_workers(self) as supervise:
            waiting = enqueue(client, segments, self.priority)
            if self.n_workers == 0 and not _has_workers(url):
                self.on_message("no worker is alive in this database; start `tts2face worker` with it")
            while waiting:
                supervise()
                for name, status in _finished(client, waiting):
                    address = waiting.pop(name)
                    result = wait_for_store(partial(store.result, address), self.on_message)
                    reason = "" if result is not None else failure_reason(status)
                    yield Rendered(address, result, reason)
                if waiting:
                    time.sleep(POLL_S + POLL_S_PER_JOB * len(waiting))


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
        raise BackendError(f"the database cannot be reached ({away}); check its URL") from away
    try:
        yield client
    finally:
        client.destroy()


def enqueue(client: Any, segments: Mapping[str, Segment], priority: int) -> dict[str, str]:
    """Queue segments; their addresses by the names of their jobs.

    The name of a job is the content address of its segment, so that two batches share it. A job that has ended without
    a stored segment is followed by a new one with the next number.
    """
    attempts: dict[str, int] = {}
    for at in range(0, len(segments), JOBS_PER_QUERY):
        names = list(segments)[at : at + JOBS_PER_QUERY]
        for one in client.list_workflows(
            workflow_id_prefix=[f"{name}." for name in names], load_input=False, load_output=False
        ):
            address, _, number = one.workflow_id.partition(".")
            following = int(number) if one.status in ACTIVE else int(number) + 1
            attempts[address] = max(attempts.get(address, 0), following)
    waiting: dict[str, str] = {}
    for address, segment in segments.items():
        name = f"{address}.{attempts.get(address, 0)}"
        options = {
            "queue_name": QUEUE,
            "workflow_name": WORKFLOW,
            "workflow_id": name,
            "app_version": APPLICATION_VERSION,
            "priority": priority,
        }
        client.enqueue(options, address, segment.as_json())
        waiting[name] = address
    return waiting


def _has_workers(url: str) -> bool:
    with Workers(url) as workers:
        return bool(workers.alive())


def _finished(client: Any, waiting: Mapping[str, str]) -> list[tuple[str, Any]]:
    """Jobs that are not active any more."""
    names = list(waiting)
    found: list[tuple[str, Any]] = []
    for at in range(0, len(names), JOBS_PER_QUERY):
        part = names[at : at + JOBS_PER_QUERY]
        jobs = client.list_workflows(workflow_ids=part, load_input=False)
        found += [(one.workflow_id, one) for one in jobs if one.status not in ACTIVE]
    return found


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
def local_workers(engine: DatabaseEngine) -> Iterator[Callable[[], None]]:
    """Workers on this machine; the value starts those that have ended or have not been started."""
    workers = _LocalWorkers(engine)
    try:
        yield workers.supervise
    finally:
        workers.end()


class _LocalWorkers:
    """Child processes that are started again when they end."""

    def __init__(self, engine: DatabaseEngine) -> None:
        self._engine = engine
        self._cores = sorted(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else []
        self._children: dict[int, tuple[subprocess.Popen[bytes], float]] = {}
        self._n_quick = 0

    def supervise(self) -> None:
        """Start the workers that do not run.

        Raises
        ------
        BackendError
            They end as soon as they start.
        """
        for number in range(self._engine.n_workers):
            child, began = self._children.get(number, (None, -RESTART_S))
            if (child is not None and child.poll() is None) or time.monotonic() - began < RESTART_S:
                continue
            if child is not None:
                self._note_end(number, child, time.monotonic() - began)
            is_bound = self._engine.n_workers > 1 and len(self._cores) > 0
            core = self._cores[number % len(self._cores)] if is_bound else None
            self._children[number] = (
                start_worker(self._engine.database, self._engine.store_url, core),
                time.monotonic(),
            )

    def end(self) -> None:
        """End all workers."""
        for child, _ in self._children.values():
            child.kill()
            child.wait()
            if child.stdin is not None:
                child.stdin.close()

    def _note_end(self, number: int, child: "subprocess.Popen[bytes]", lived_s: float) -> None:
        self._engine.on_message(f"worker {number + 1} ended with code {child.returncode}; it is started again")
        if child.stdin is not None:
            child.stdin.close()
        self._n_quick = self._n_quick + 1 if lived_s < QUICK_END_S else 0
        if self._n_quick >= MAX_QUICK_ENDS:
            raise BackendError("the workers end as soon as they start; see their messages above")


def start_worker(database: str, store: str, core: int | None) -> "subprocess.Popen[bytes]":
    """A worker as a child process, which ends with this one."""
    return subprocess.Popen(
        [sys.executable, "-m", "tts2face.jobs.worker", database, store, "all" if core is None else str(core)],
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
    )
