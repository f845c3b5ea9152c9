"""Jobs of a running server: the database, the worker processes, webhooks and the removal of what is old."""

import asyncio
import logging
import threading
import uuid
from collections.abc import Awaitable, Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from typing import TypeVar

from lexicon.errors import BackendError, Tts2faceError
from tts2face.serving.batch.engine import lack_of_room
from tts2face.serving.batch.prune import prune_unused
from tts2face.serving.batch.store import open_store
from tts2face.serving.service.access import RateLimits
from tts2face.serving.service.errors import RefusedError, as_refused
from tts2face.serving.service.job_views import message_of
from tts2face.serving.service.library import Library
from tts2face.serving.service.logs import log_event
from tts2face.serving.service.pool import NICENESS
from tts2face.serving.service.settings import ServiceSettings
from tts2face.serving.service.webhooks import Webhooks
from tts2face.serving.work.blobs import open_blobs
from tts2face.serving.work.client import JobClient
from tts2face.serving.work.database import database_url, prepare_database, shown_url
from tts2face.serving.work.jobs import STATES, OtherBodyError, QueueFullError
from tts2face.serving.work.local_workers import LocalWorkers, local_workers
from tts2face.serving.work.queue_control import prune_jobs, unfinished_segments
from tts2face.serving.work.run import BLOBS
from tts2face.storage.files import translate_disk_errors
from tts2face.storage.sql import DatabaseAwayError, connection_errors

Value = TypeVar("Value")
RETRY_S = 2.0  # between two tries to open the database
RETRY_AFTER_S = 5  # for clients, while the database cannot be reached
SUPERVISE_S, RESTART_S = 0.5, 10.0  # between two checks of the workers, and after they ended again and again
# seconds between two times
SHARE_S = 0.5
# seconds between two countings of jobs for the metrics
STATISTICS_S = 5.0
# seconds between two removals of what is old
SWEEP_S = 3600.0
PROBE_S = 3.0  # of the database for /readyz
DAY_S = 86_400.0
MIN_AGE_S = DAY_S  # of files and segments: a younger one may belong to a job that is being queued or planned
N_THREADS = 8  # that wait for the database; the other parts of the server never do


class JobService:
    """Jobs of a server; while the database cannot be reached, only they are refused.

    Parameters
    ----------
    settings
        Settings of the service.
    library
        Uploaded models.
    limits
        Of the keys, which servers of one database share.
    """

    def __init__(self, settings: ServiceSettings, library: Library, limits: RateLimits) -> None:
        self._settings = settings
        self._library = library
        self._limits = limits
        self._name = uuid.uuid4().hex  # of this server
        self._client: JobClient | None = None
        self._reason = ""  # why the database cannot be reached
        self._threads = ThreadPoolExecutor(N_THREADS, thread_name_prefix="jobs")
        self._webhooks = Webhooks(settings, self.call, message_of)
        self._tasks: list[asyncio.Task[None]] = []
        self._stopped = threading.Event()
        self._supervisor: threading.Thread | None = None
        self.on_defect: Callable[[BaseException], None] = _ignore  # called with what ends a loop of this object
        self.n_workers = 0  # local ones that are alive
        self.counts, self.oldest_waiting_s = dict.fromkeys(STATES, 0), 0.0

    def start(self) -> None:
        """Open the database in the background, then start workers and loops, in the running event loop."""
        self._tasks = [asyncio.create_task(self._run())]

    async def close(self) -> None:
        """End the workers; their jobs go on when the service is started again."""
        self._stopped.set()
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        if self._supervisor is not None:
            await asyncio.to_thread(self._supervisor.join)
        self._threads.shutdown(wait=False, cancel_futures=True)
        if self._client is not None:
            self._client.close()

    @property
    def client(self) -> JobClient:
        """Client of the database.

        Raises
        ------
        RefusedError
            The database has not been opened yet.
        """
        if self._client is None:
            raise self._unavailable()
        return self._client

    async def call(self, function: Callable[[JobClient], Value]) -> Value:
        """Value of a function of the client, in a thread of those of the database.

        Raises
        ------
        RefusedError
            The database cannot be reached (503), or the function raised an error of the project.
        """
        client = self.client
        away_errors: tuple[type[Exception], ...] = (DatabaseAwayError, *connection_errors())
        try:
            value = await asyncio.get_running_loop().run_in_executor(self._threads, function, client)
        except away_errors as away:
            self._note_away(str(away))
            raise self._unavailable() from away
        except OtherBodyError as other:
            raise RefusedError(422, "idempotency_conflict", str(other)) from other
        # before Tts2faceError, whose class it is
        except QueueFullError as full:
            raise RefusedError(429, "queue_full", str(full), {"Retry-After": "30"}) from full
        except Tts2faceError as error:
            raise as_refused(error) from error
        self._note_away("")
        return value

    def _unavailable(self) -> RefusedError:
        """Refusal of a request of jobs; a full disk, on which a database cannot write, is named."""
        folder = self._settings.data_folder
        reason = lack_of_room(folder, "data folder") if folder.exists() else ""
        what = reason or "as their database cannot be reached; repeat the request later"
        message = f"the jobs are not available now{':' if reason else ','} {what}"
        return RefusedError(503, "unavailable", message, {"Retry-After": str(RETRY_AFTER_S)})

    def _note_away(self, reason: str) -> None:
        """Write once to the log that the database cannot be reached, and once that it can be reached again."""
        if bool(reason) != bool(self._reason):
            self._reason = reason
            if reason:
                log_event("jobs not available", level=logging.WARNING, reason=reason)
            else:
                log_event("jobs available", database=shown_url(self._settings.database_place))

    async def is_reachable(self) -> bool:
        """Whether the database answers within `PROBE_S`."""
        try:
            return await asyncio.wait_for(self.call(JobClient.is_reachable), PROBE_S)
        except (RefusedError, TimeoutError):
            return False

    async def _run(self) -> None:
        while self._client is None:
            try:
                self._client = await asyncio.to_thread(self._open)
            except Tts2faceError as wrong:
                self._note_away(str(wrong))
                await asyncio.sleep(RETRY_S)
        self._note_away("")
        if self._settings.workers:
            self._supervisor = threading.Thread(target=self._supervise, name="supervisor", daemon=True)
            self._supervisor.start()
        actions = ((self._share_limits, SHARE_S), (self._count, STATISTICS_S), (self._sweep, SWEEP_S))
        for work in (self._webhooks.run(), *(self._repeat(action, pause_s) for action, pause_s in actions)):
            task = asyncio.create_task(work)
            task.add_done_callback(self._note_end)
            self._tasks.append(task)

    def _open(self) -> JobClient:
        folder, settings = self._settings.data_folder, self._settings
        with translate_disk_errors(folder):
            folder.mkdir(parents=True, exist_ok=True)
        url = database_url(settings.database_place)
        prepare_database(url)
        return JobClient(url, open_blobs(settings.store_place, BLOBS, cache=folder / "results-cache"))

    def _supervise(self) -> None:
        settings = self._settings
        wanted = LocalWorkers(
            settings.database_place, settings.store_place, settings.workers,
            on_message=_log_worker, niceness=NICENESS, signing=settings.signing,
        )  # fmt: skip
        while not self._stopped.is_set():
            with suppress(BackendError), local_workers(wanted) as supervise:
                while not self._stopped.wait(SUPERVISE_S):
                    self.n_workers = supervise()
            self.n_workers = 0
            self._stopped.wait(RESTART_S)  # the workers cannot start now, such as while the database is away

    async def _repeat(self, action: Callable[[], Awaitable[None]], pause_s: float) -> None:
        while True:
            with suppress(RefusedError):  # the database is away; the next time may succeed
                await action()
            await asyncio.sleep(pause_s)

    def _note_end(self, task: "asyncio.Task[None]") -> None:
        if not task.cancelled() and (error := task.exception()) is not None:
            self.on_defect(error)

    async def _share_limits(self) -> None:
        if self._settings.keys is not None:
            name = self._name
            await self._limits.share(lambda *used: self.call(lambda client: client.usage.exchange(name, *used)))

    async def _count(self) -> None:
        self.counts, self.oldest_waiting_s = await self.call(lambda client: client.table.counts())

    async def _sweep(self) -> None:
        """Remove files that nothing has, and jobs, results and segments older than the setting `results_days`."""
        await self.call(lambda client: client.usage.forget_old())
        n_files = await self.call(lambda client: client.remove_unused_files(MIN_AGE_S))
        n_files += await self.call(lambda _: self._library.remove_unused_files(MIN_AGE_S))
        old: list[str] = []
        n_segments, age_s = 0, self._settings.results_days * DAY_S
        if age_s:
            old = await self.call(lambda client: client.table.ended_before(age_s))
            for job_id in old:
                await self.call(lambda client, job_id=job_id: client.delete(job_id))  # type: ignore[misc]
            n_segments = await self.call(lambda _: self._prune(max(age_s, MIN_AGE_S)))
        if old or n_segments or n_files:
            log_event("old jobs removed", jobs=len(old), segments=n_segments, files=n_files, days=age_s / DAY_S)

    def _prune(self, age_s: float) -> int:
        database = self._settings.database_place
        pruned = prune_unused(open_store(self._settings.store_place), unfinished_segments(database), age_s)
        prune_jobs(database, age_s)
        return pruned.n_removed


def _ignore(_: BaseException) -> None:
    pass


def _log_worker(message: str) -> None:
    log_event("workers", message=message)
