"""The engine of a batch that queues its segments in a database and waits for the workers."""

import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

from tts2face.serving.batch.engine import OnMessage, Rendered
from tts2face.serving.batch.segment import Segment
from tts2face.serving.batch.store import Store, wait_for_store
from tts2face.serving.work.database import database_url, prepare_database
from tts2face.serving.work.local_workers import LocalWorkers, local_workers
from tts2face.serving.work.segment_queue import ACTIVE, JOBS_PER_QUERY, enqueue, failure_reason, open_client
from tts2face.serving.work.workers import Workers

POLL_S = 0.5  # between two polls of the jobs that are awaited


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
        Called at each poll of the jobs; what it raises ends the waiting.
    """

    database: str
    store_url: str
    n_workers: int = 1
    priority: int = 10
    on_message: OnMessage = lambda _: None
    on_wait: Callable[[], None] = lambda: None

    def render(self, segments: Mapping[str, Segment], store: Store) -> Iterator[Rendered]:
        """Yield each segment as soon as it is stored or has failed."""
        if not segments:
            return
        url = database_url(self.database)
        prepare_database(url)
        here = LocalWorkers(self.database, self.store_url, self.n_workers, self.on_message)
        with open_client(url) as client, Workers(url) as workers, local_workers(here) as supervise:
            awaited = _Awaited(client, enqueue(client, workers, segments, self.priority))
            if self.n_workers == 0 and not workers.alive():
                self.on_message("no worker is alive in this database; start `tts2face worker` with it")
            while awaited.waiting:
                supervise()
                self.on_wait()
                for address, reason in awaited.ended():
                    result = wait_for_store(partial(store.result, address), self.on_message)
                    yield Rendered(address, result, "" if result is not None else reason)
                if awaited.waiting:
                    time.sleep(POLL_S)


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
                reasons[name] = "its job was removed from the database; run again"
            elif job.status not in ACTIVE:
                reasons[name] = failure_reason(job)
        return [(self.waiting.pop(name), reason) for name, reason in reasons.items()]

    def _found(self, names: list[str]) -> dict[str, Any]:
        """Jobs by their names; None of one that is gone."""
        jobs = self.client.list_workflows(workflow_ids=names, load_input=False)
        return dict.fromkeys(names) | {job.workflow_id: job for job in jobs}
