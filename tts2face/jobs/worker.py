"""A worker: takes segments from the queue of a database, renders them in a child process, and takes over from the dead.

DBOS keeps the queue. Its open-source package has no fail-over of its own: work of an executor that died waits for an
executor of the same id. Here every worker has a new id and gives signs of life (`tts2face.jobs.database.Workers`), and
each worker looks again and again, not once, for running work of executors without a sign of life and returns it to the
queue. A segment that two workers take nevertheless is rendered twice and stored once, as its name is its content
address.
"""

import contextlib
import os
import socket
import sys
import threading
import time
import uuid
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

from lexicon.errors import DataError, Tts2faceError
from tts2face.batch.address import SEGMENT_FORMAT
from tts2face.batch.engine import Message, Renders, render_into
from tts2face.batch.render_process import RenderProcess
from tts2face.batch.segment import segment_from_json
from tts2face.batch.store import Store, open_store, wait_for_store
from tts2face.jobs.database import (
    APPLICATION,
    BEAT_S,
    QUEUE,
    Workers,
    database_url,
    prepare_database,
    quiet_dbos,
)

APPLICATION_VERSION = f"segments-{SEGMENT_FORMAT}"  # pinned: workers of equal segments share their work
WORKFLOW = "render_segment"
MAX_DEATHS = 8  # of workers that had the same segment; then it counts as failed
POLL_S = 0.2
N_TAKEN = 2  # jobs that a worker holds: one is rendered, one waits, so that no time is lost between them


class SegmentFailedError(RuntimeError):
    """A segment that cannot be rendered; the reason is kept in the database."""


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

    Raises
    ------
    InputError, BackendError
        The database or store cannot be used.
    """

    def __init__(
        self,
        database: str,
        store: str,
        *,
        renderer: Renders | None = None,
        core: int | None = None,
        on_message: Message = lambda _: None,
    ) -> None:
        self._url = database_url(database)
        self._store: Store = open_store(store)
        self._process = RenderProcess(core) if renderer is None else None
        self._renderer: Renders = renderer or self._process  # type: ignore[assignment]
        self._on_message = on_message
        self.executor_id = f"{uuid.uuid4().hex[:20]}"
        self._place = f"{socket.gethostname()}, process {os.getpid()}"
        self._stopped = threading.Event()
        self._rendering = threading.Lock()  # one segment at a time
        self.n_rendered = 0

    def run(self, until: Callable[[], bool] = lambda: False) -> None:
        """Work until `until` returns true, or `stop` is called."""
        self._store.check()
        prepare_database(self._url)
        from dbos import DBOS

        quiet_dbos()
        DBOS(
            config={
                "name": APPLICATION,
                "system_database_url": self._url,
                "application_version": APPLICATION_VERSION,
                "executor_id": self.executor_id,
                "log_level": "ERROR",
                "enable_otlp": False,
                "max_executor_threads": 4,
                "run_migrations": False,
            }
        )

        @DBOS.workflow(name=WORKFLOW, max_recovery_attempts=MAX_DEATHS)
        def render_segment(address: str, content: dict[str, Any]) -> dict[str, Any]:
            return self._render(address, content)

        with Workers(self._url) as workers:
            workers.beat(self.executor_id, self._place)
            DBOS.launch()
            DBOS.register_queue(QUEUE, worker_concurrency=N_TAKEN, polling_interval_sec=POLL_S)
            beats = threading.Thread(target=self._beat, args=(workers,), name="beat", daemon=True)
            beats.start()
            try:
                while not self._stopped.wait(BEAT_S) and not until():
                    self._take_over(workers)
            finally:
                self._stopped.set()
                beats.join(2 * BEAT_S)
                if self._process is not None:
                    self._process.close()
                DBOS.destroy(workflow_completion_timeout_sec=0)
                with contextlib.suppress(Exception):
                    workers.forget([self.executor_id])

    def stop(self) -> None:
        """End `run` soon; a segment in work is taken over by other workers."""
        self._stopped.set()

    def _render(self, address: str, content: dict[str, Any]) -> dict[str, Any]:
        """Render a segment unless it is stored; after a death it runs again and has no other effect."""
        segment = segment_from_json(content)
        try:
            found = wait_for_store(partial(self._store.result, address), self._on_message)
            if found is not None:
                return found.as_json()
            if replace(segment, file_hashes=segment.input_hashes()).address != address:
                raise DataError(
                    "a model, voice, file or program version of this machine differs from that of the batch; "
                    "install and copy the same ones"
                )
        except Tts2faceError as wrong:
            raise SegmentFailedError(str(wrong)) from None
        with self._rendering:
            rendered = render_into(self._store, segment, self._renderer, self._on_message)
        if rendered.result is None:
            raise SegmentFailedError(rendered.reason)
        self.n_rendered += 1
        return rendered.result.as_json()

    def _beat(self, workers: Workers) -> None:
        """Give signs of life, also while the database is away for a time."""
        import sqlalchemy

        while not self._stopped.wait(BEAT_S):
            try:
                workers.beat(self.executor_id, self._place)
            except sqlalchemy.exc.SQLAlchemyError as away:
                self._on_message(f"the database cannot be reached ({type(away).__name__}); trying again")

    def _take_over(self, workers: Workers) -> None:
        """Return running work of executors without a sign of life to the queue; called again and again."""
        import sqlalchemy
        from dbos import DBOS
        from dbos import error as dbos_error

        try:
            running = DBOS.list_workflows(status="PENDING", name=WORKFLOW, load_input=False, load_output=False)
            owners = {str(one.executor_id) for one in running if one.executor_id} - {self.executor_id}
            dead = owners - set(workers.alive()) if owners else set()
            if dead:
                DBOS._recover_pending_workflows(sorted(dead))
                workers.forget(dead)
                self._on_message(f"took over from {len(dead)} workers without a sign of life")
        except (sqlalchemy.exc.SQLAlchemyError, dbos_error.DBOSException) as away:
            self._on_message(f"the database cannot be reached ({type(away).__name__}); trying again")


def main() -> None:
    """Run one worker that ends with its parent: ``python -m tts2face.jobs.worker DATABASE STORE CORE``."""
    from tts2face.child_process import exit_after

    database, store, core = sys.argv[1:4]
    if hasattr(os, "sched_setaffinity") and core.isdecimal():
        os.sched_setaffinity(0, {int(core)})

    def wait_for_parent() -> None:
        while os.read(0, 1):
            continue

    exit_after(wait_for_parent)
    write = sys.stderr.write
    worker = Worker(
        database, store, core=int(core) if core.isdecimal() else None, on_message=lambda text: _say(write, text)
    )
    worker.run()


def _say(write: Callable[[str], Any], text: str) -> None:
    write(f"{time.strftime('%H:%M:%S')} {text}\n")


if __name__ == "__main__":
    main()
