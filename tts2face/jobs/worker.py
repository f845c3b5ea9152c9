"""A worker: takes segments from the queue of a database, renders them in a child process, and takes over from the dead.

DBOS keeps the queue. Its open-source package has no fail-over of its own: work of an executor that died waits for an
executor of the same id. Here every worker has a new id and gives signs of life (`tts2face.jobs.database.Workers`); with
each of them it learns which workers have given none for some time, and returns their work to the queue. A worker is
forgotten only when none of its work is running any more. Now and then each worker also looks at all running work, for
owners that are not in the table. A segment that two workers take nevertheless is rendered twice and stored once, as its
name is its content address.
"""

import contextlib
import logging
import os
import random
import socket
import sys
import threading
import time
import uuid
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

from lexicon.errors import BackendError, DataError, Tts2faceError
from tts2face.batch.engine import Message, Renders, render_into
from tts2face.batch.render_process import RenderProcess
from tts2face.batch.segment import segment_from_json
from tts2face.batch.store import Store, open_store, wait_for_store
from tts2face.jobs.database import (
    APPLICATION,
    APPLICATION_VERSION,
    BEAT_S,
    QUEUE,
    WORKFLOW,
    Workers,
    database_url,
    prepare_database,
    quiet_dbos,
)
from tts2face.jobs.takeover import list_running, poll_interval, return_work

MAX_DEATHS = 8  # of workers that had the same segment; then it counts as failed
ALL_WORK_S = 60.0  # between two looks at all running work
N_TAKEN = 2  # jobs that a worker holds: one is rendered, one waits, so that no time is lost between them
START_FAILED = 4  # exit code, as of the command for BackendError
# Connections of a worker to the database: two stay open, besides that of its signs of life.
CONNECTIONS = {"pool_size": 2, "max_overflow": 3}


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
        self._vanished: set[str] = set()
        self._next_all_work_s = 0.0
        self._noting = threading.Lock()
        self._is_reached = True
        self.n_rendered = 0

    def run(self, until: Callable[[], bool] = lambda: False) -> None:
        """Work until `until` returns true, or `stop` is called."""
        self._store.check()
        prepare_database(self._url)
        from dbos import DBOS

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
                "use_listen_notify": False,  # a connection that nothing here needs
                "db_engine_kwargs": dict(CONNECTIONS),
            }
        )

        @DBOS.workflow(name=WORKFLOW, max_recovery_attempts=MAX_DEATHS)
        def render_segment(address: str, content: dict[str, Any]) -> dict[str, Any]:
            return self._render(address, content)

        with Workers(self._url) as workers:
            self._launch(workers)
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
                    workers.leave(self.executor_id)

    def _launch(self, workers: Workers) -> None:
        import sqlalchemy
        from dbos import DBOS
        from dbos import error as dbos_error

        quiet_dbos(logging.CRITICAL)  # a failure is raised
        try:
            workers.beat(self.executor_id, self._place)
            DBOS.launch()
            interval_s = poll_interval(len(workers.alive()))
            DBOS.register_queue(QUEUE, worker_concurrency=N_TAKEN, polling_interval_sec=interval_s)
        except (sqlalchemy.exc.SQLAlchemyError, dbos_error.DBOSException) as away:
            reason = " ".join(str(getattr(away, "orig", None) or away).split())
            raise BackendError(f"the worker cannot start: {reason[:200]}; check the database") from away
        finally:
            quiet_dbos()

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
                self._vanished = workers.beat(self.executor_id, self._place)
            except sqlalchemy.exc.SQLAlchemyError as away:
                self._note_database(away)
            else:
                self._note_database(None)

    def _take_over(self, workers: Workers) -> None:
        """Return the work of workers without a sign of life to the queue; called again and again."""
        import sqlalchemy
        from dbos import error as dbos_error

        try:
            dead = set(self._vanished)
            if time.monotonic() >= self._next_all_work_s:
                dead |= self._look_at_all_work(workers)
                self._next_all_work_s = time.monotonic() + ALL_WORK_S * random.uniform(0.5, 1.5)
            dead.discard(self.executor_id)
            if dead:
                ended = return_work(dead)
                workers.forget(ended)
                self._vanished -= ended
                if ended:
                    self._on_message(f"took over from {len(ended)} workers without a sign of life")
        except (sqlalchemy.exc.SQLAlchemyError, dbos_error.DBOSException) as away:
            self._note_database(away)

    def _note_database(self, away: Exception | None) -> None:
        """Say once that the database cannot be reached, and once that it can be reached again."""
        with self._noting:
            if (away is None) != self._is_reached:
                self._is_reached = away is None
                self._on_message(
                    "the database can be reached again"
                    if away is None
                    else f"the database cannot be reached ({type(away).__name__}); trying again"
                )

    @staticmethod
    def _look_at_all_work(workers: Workers) -> set[str]:
        """Owners of running work that give no sign of life; the interval of the queue follows the number of workers."""
        from dbos import DBOS

        alive = set(workers.alive())
        queue = DBOS.retrieve_queue(QUEUE)
        wanted = poll_interval(len(alive))
        if queue is not None and not 0.8 < wanted / queue.polling_interval_sec < 1.25:
            queue.set_polling_interval_sec(wanted)
        return {str(one.executor_id) for one in list_running() if one.executor_id} - alive


def main() -> None:
    """Run one worker that ends with its parent: ``python -m tts2face.jobs.worker DATABASE STORE CORE``."""
    from tts2face.child_process import bind_to_core, exit_after

    database, store, core = sys.argv[1:4]
    bound = int(core) if core.isdecimal() else None
    bind_to_core(bound)

    def wait_for_parent() -> None:
        while os.read(0, 1):
            continue

    exit_after(wait_for_parent)
    write = sys.stderr.write
    try:
        Worker(database, store, core=bound, on_message=lambda text: _say(write, text)).run()
    except Tts2faceError as wrong:
        _say(write, str(wrong))
        raise SystemExit(START_FAILED) from None


def _say(write: Callable[[str], Any], text: str) -> None:
    write(f"{time.strftime('%H:%M:%S')} {text}\n")


if __name__ == "__main__":
    main()
