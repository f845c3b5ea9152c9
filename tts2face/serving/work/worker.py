"""A worker: takes segments and jobs from the queues of a database, and takes over from the dead.

Segments are rendered in a child process. A job of the service plans, queues its segments and waits for them, so that
all workers share the rendering; the queues have places of their own, so that jobs never block what they wait for.
"""

import contextlib
import logging
import os
import random
import socket
import threading
import time
import uuid
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

from lexicon.errors import BackendError
from tts2face.processes.child import Call, Handler
from tts2face.serving.batch.engine import OnMessage, SegmentRenderer
from tts2face.serving.batch.store import Store, open_store
from tts2face.serving.work.database import database_url, prepare_database, quiet_dbos
from tts2face.serving.work.pauses import EnginePauses
from tts2face.serving.work.queues import (
    APPLICATION,
    APPLICATION_VERSION,
    JOB_WORKFLOW,
    PLACES,
    WORK,
    WORKFLOW,
)
from tts2face.serving.work.run import JobRunner, job_blobs
from tts2face.serving.work.segment_worker import SegmentWorker, is_cancelled
from tts2face.serving.work.workers import BEAT_S, Workers, list_running, return_work
from tts2face.storage.signing import Credentials, Signer
from tts2face.storage.sql import DatabaseAwayError, database_reason

POLL_S = 0.2  # between two polls of the queue
MAX_POLLS_PER_S = 200.0  # of all workers together: with more than 40, each polls less often
MAX_DEATHS = 8  # of workers that had the same segment; then it counts as failed
ALL_WORK_S = 60.0  # between two polls of all running work
MAX_JOB_DEATHS = 30  # of workers that executed the same job of the service, which lasts longer than a segment
# Connections of a worker to the database: two stay open, besides that of its heartbeats.
CONNECTIONS = {"pool_size": 2, "max_overflow": 3}


def poll_interval(n_workers: int) -> float:
    """Seconds between two polls of the queue by a worker, for a number of workers."""
    return max(POLL_S, n_workers / MAX_POLLS_PER_S)


class Worker:
    """A worker of a database.

    Parameters
    ----------
    database
        SQLite file or PostgreSQL URL.
    store
        Store of the segments: a folder or a URL.
    renderer
        What renders; None: a child process.
    core
        Core to which the child process is bound; None: all.
    signer
        Who signs the results of jobs; None: nobody.
    """

    def __init__(
        self,
        database: str,
        store: str,
        *,
        renderer: SegmentRenderer | None = None,
        core: int | None = None,
        on_message: OnMessage = lambda _: None,
        signer: Signer | None = None,
    ) -> None:
        self._url = database_url(database)
        self._store: Store = open_store(store)
        blobs = job_blobs(store)
        self._segments = SegmentWorker(self._store, blobs, renderer=renderer, core=core, on_message=on_message)
        self._jobs = JobRunner(self._url, self._store, blobs, signer)
        self._on_message = on_message
        self.executor_id = f"{uuid.uuid4().hex[:20]}"
        self._place = f"{socket.gethostname()}, process {os.getpid()}"
        self._stopped = threading.Event()
        self._pauses = EnginePauses()
        self._poll_s = poll_interval(1)
        self._vanished: set[str] = set()
        self._next_all_work_s = 0.0
        self._noting = threading.Lock()
        self._is_reached, self._reached_s = True, 0.0

    @property
    def n_rendered(self) -> int:
        """Number of segments rendered so far."""
        return self._segments.n_rendered

    def run(self, until: Callable[[], bool] = lambda: False) -> None:
        """Work until `until` returns true, or `stop` is called."""
        self._store.check()
        prepare_database(self._url)
        from dbos import DBOS

        engine = DBOS(
            config={
                "name": APPLICATION,
                "system_database_url": self._url,
                "application_version": APPLICATION_VERSION,
                "executor_id": self.executor_id,
                "log_level": "ERROR",
                "enable_otlp": False,
                "max_executor_threads": sum(PLACES.values()) + 2,
                "run_migrations": False,
                "use_listen_notify": False,  # a connection that nothing here needs
                "db_engine_kwargs": dict(CONNECTIONS),
            }
        )

        @DBOS.workflow(name=WORKFLOW, max_recovery_attempts=MAX_DEATHS)
        def render_segment(address: str, content: dict[str, Any]) -> dict[str, Any]:
            with self._pauses.busy():
                return self._segments.work(str(DBOS.workflow_id), address, content)

        @DBOS.workflow(name=JOB_WORKFLOW, max_recovery_attempts=MAX_JOB_DEATHS)
        def run_job(job_id: str) -> str:
            with self._pauses.busy():
                return self._jobs.run(job_id)

        with Workers(self._url) as workers:
            self._launch(workers)
            self._pauses.install(engine)
            beats = threading.Thread(target=self._beat, args=(workers,), name="beat", daemon=True)
            beats.start()
            try:
                while not self._stopped.wait(BEAT_S) and not until():
                    self._take_over(workers)
            finally:
                self._stopped.set()
                beats.join(2 * BEAT_S)
                self._segments.close()
                self._pauses.wake()
                DBOS.destroy(workflow_completion_timeout_sec=0)
                with contextlib.suppress(Exception):
                    workers.leave(self.executor_id)

    def _launch(self, workers: Workers) -> None:
        import sqlalchemy
        from dbos import DBOS
        from dbos import error as dbos_error

        quiet_dbos(logging.CRITICAL)  # a failure is raised, or kept in the database with its reason
        try:
            workers.beat(self.executor_id, self._place)
            DBOS.launch()
            self._poll_s = poll_interval(len(workers.alive()))
            for queue, n_places in PLACES.items():
                DBOS.register_queue(queue, worker_concurrency=n_places, polling_interval_sec=self._poll_s)
        except (sqlalchemy.exc.SQLAlchemyError, dbos_error.DBOSException, DatabaseAwayError) as away:
            raise BackendError(f"the worker cannot start: {database_reason(away)}; check the database") from away

    def stop(self) -> None:
        """End `run` soon; a segment in work is taken over by other workers."""
        self._stopped.set()

    def _beat(self, workers: Workers) -> None:
        """Send heartbeats and poll for work, also while the database is away for a time."""
        import sqlalchemy

        next_beat_s = time.monotonic() + BEAT_S
        while not self._stopped.wait(self._poll_s if self._is_reached else BEAT_S):
            began_s = time.monotonic()
            is_due, is_asleep = began_s >= next_beat_s, not self._pauses.is_awake
            if not (is_due or is_asleep):
                continue  # nothing is asked of the database, so nothing is learnt about it
            try:
                if is_asleep and workers.has_waiting():
                    self._pauses.wake()
                if is_due:
                    next_beat_s = began_s + BEAT_S
                    self._vanished = workers.beat(self.executor_id, self._place)
            except (sqlalchemy.exc.SQLAlchemyError, DatabaseAwayError) as away:
                self._note_database(away, began_s)
            else:
                self._note_database(None, began_s)

    def _take_over(self, workers: Workers) -> None:
        """Return the work of workers without a heartbeat to the queue; called again and again."""
        import sqlalchemy
        from dbos import error as dbos_error

        began_s = time.monotonic()
        try:
            dead = set(self._vanished)
            self._segments.end_cancelled(is_cancelled)
            if began_s >= self._next_all_work_s:
                dead |= self._poll_all_work(workers)
                self._jobs.end_abandoned()
                self._next_all_work_s = began_s + ALL_WORK_S * random.uniform(0.5, 1.5)
            dead.discard(self.executor_id)
            if dead:
                ended = return_work(dead)
                workers.forget(ended)
                self._vanished -= ended
                if ended:
                    self._on_message(f"took over from {len(ended)} workers without a heartbeat")
        except (sqlalchemy.exc.SQLAlchemyError, dbos_error.DBOSException, DatabaseAwayError) as away:
            self._note_database(away, began_s)

    def _note_database(self, away: Exception | None, began_s: float) -> None:
        """Say once that the database cannot be reached, and once that it can be reached again.

        A failure of what began before the database was last reached is older news.
        """
        with self._noting:
            if away is None:
                self._reached_s = time.monotonic()
            elif began_s < self._reached_s:
                return
            if (away is None) != self._is_reached:
                self._is_reached = away is None
                self._on_message(
                    "the database can be reached again"
                    if away is None
                    else f"the database cannot be reached ({type(away).__name__}); trying again"
                )

    def _poll_all_work(self, workers: Workers) -> set[str]:
        """Owners of running work that send no heartbeat; the interval of the queue follows the number of workers."""
        from dbos import DBOS

        alive = set(workers.alive())
        workers.return_later()
        wanted = self._poll_s = poll_interval(len(alive))
        for name in PLACES:
            queue = DBOS.retrieve_queue(name)
            if queue is not None and not 0.8 < wanted / queue.polling_interval_sec < 1.25:
                queue.set_polling_interval_sec(wanted)
        return {str(job.executor_id) for job in list_running() if job.executor_id} - alive


def work(call: Call) -> dict[str, Any]:
    """Work on a ``database`` and a ``store`` with a renderer on a ``core``; events are lines of messages.

    Raises
    ------
    InputError, BackendError
        As `Worker`.
    """
    order = call.content

    def send(text: str) -> None:
        call.event({"line": f"{time.strftime('%H:%M:%S')} {text}"})

    signing = order.get("signing")
    signer = None if signing is None else Credentials.from_json(signing).open()
    Worker(order["database"], order["store"], core=order["core"], on_message=send, signer=signer).run()
    return {}


HANDLERS: Mapping[str, Handler] = MappingProxyType({WORK: work})
