"""Engines that queue segments in a database, under names by their content, and wait for its workers."""

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass
from functools import partial
from typing import Any

from tts2face.serving.batch.engine import OnMessage, Rendered
from tts2face.serving.batch.segment import Segment
from tts2face.serving.batch.store import Store, wait_for_store
from tts2face.serving.work.database import database_url, prepare_database
from tts2face.serving.work.local_workers import LocalWorkers, local_workers
from tts2face.serving.work.queues import APPLICATION, APPLICATION_VERSION, QUEUE, WORKFLOW
from tts2face.serving.work.workers import Workers
from tts2face.storage.sql import Database, DatabaseAwayError

POLL_S = 0.5  # between two polls of the jobs that are awaited
JOBS_PER_QUERY = 500
ACTIVE = frozenset({"PENDING", "ENQUEUED", "DELAYED"})


@dataclass(frozen=True, slots=True)
class QueueEngine:
    """Queues segments for the workers of a prepared database, which are started elsewhere.

    Parameters
    ----------
    priority
        Jobs with smaller numbers are taken first; from 1.
    on_message
        Called with lines for people.
    on_wait
        Called at each poll of the jobs; what it raises ends the waiting.
    """

    url: str
    priority: int
    on_message: OnMessage = lambda _: None
    on_wait: Callable[[], object] = lambda: None

    def render(self, segments: Mapping[str, Segment], store: Store) -> Iterator[Rendered]:
        """Yield each segment as soon as it is stored or has failed."""
        with open_client(self.url) as client, closing(Database(self.url)) as database:
            awaited = _Awaited(client, enqueue(client, database, segments, self.priority))
            while awaited.waiting:
                self.on_wait()
                for address, reason in awaited.ended():
                    result = wait_for_store(partial(store.result, address), self.on_message)
                    yield Rendered(address, result, "" if result is not None else reason)
                # the last one ends the loop at once
                if awaited.waiting:
                    time.sleep(POLL_S)


@dataclass(frozen=True, slots=True)
class DatabaseEngine:
    """Queues the segments of a batch in a database, and starts workers on this machine.

    Parameters
    ----------
    store_url
        Store as the local workers open it.
    n_workers
        Workers started on this machine while the batch runs; with 0 only those of other machines work.
    priority
        Jobs with smaller numbers are taken first; from 1.
    on_message
        Called with lines for people; in other threads with those of the local workers.
    """

    database: str
    store_url: str
    n_workers: int = 1
    priority: int = 10
    on_message: OnMessage = lambda _: None

    def render(self, segments: Mapping[str, Segment], store: Store) -> Iterator[Rendered]:
        """Yield each segment as soon as it is stored or has failed."""
        if not segments:
            return
        url = database_url(self.database)
        prepare_database(url)
        here = LocalWorkers(self.database, self.store_url, self.n_workers, self.on_message)
        with Workers(url) as workers, local_workers(here) as supervise:
            if self.n_workers == 0 and not workers.alive():
                self.on_message("no worker is alive in this database; start `tts2face worker` with it")
            yield from QueueEngine(url, self.priority, self.on_message, supervise).render(segments, store)


@dataclass(slots=True)
class _Awaited:
    """Jobs that are awaited, polled by their names: no clock says which of them have ended since the last poll.

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

        Of many jobs it polls those that were queued first, which end first, and one further part after the other.
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
                # `tts2face jobs prune` removes jobs that others still await
                reasons[name] = "its job was removed from the database; run again"
            elif job.status not in ACTIVE:
                reasons[name] = failure_reason(job)
        return [(self.waiting.pop(name), reason) for name, reason in reasons.items()]

    def _found(self, names: list[str]) -> dict[str, Any]:
        """Jobs by their names; None of one that is gone."""
        jobs = self.client.list_workflows(workflow_ids=names, load_input=False)
        return dict.fromkeys(names) | {job.workflow_id: job for job in jobs}


@contextmanager
def open_client(url: str) -> Iterator[Any]:
    """Client of a prepared database."""
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


def enqueue(client: Any, database: Database, segments: Mapping[str, Segment], priority: int) -> dict[str, str]:
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
            with database.transaction() as change:
                for job in jobs:
                    client.enqueue_in_transaction(change.connection, *job)
        except (
            sqlalchemy.exc.DBAPIError,
            DatabaseAwayError,
        ):  # such as a deadlock with a batch of the same segments in another order
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
        for job in client.list_workflows(workflow_ids=names, load_input=False, load_output=False):
            address = job.workflow_id.partition(".")[0]
            if job.status in ACTIVE:
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
