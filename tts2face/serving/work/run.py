"""Execution of jobs of the service by a worker: each ends once, whatever dies meanwhile."""

import logging
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache, partial
from importlib import import_module
from pathlib import Path
from tempfile import gettempdir
from typing import Any

from lexicon.errors import DataError, Tts2faceError
from tts2face.serving.batch.engine import MIN_FREE_BYTES, Rendered, free_bytes
from tts2face.serving.batch.segment import Segment
from tts2face.serving.batch.store import Store, wait_for_store
from tts2face.serving.work.blobs import BlobStore, open_blobs, place_file, place_models
from tts2face.serving.work.changes import Ending, JobChanges
from tts2face.serving.work.engine import ACTIVE, JOBS_PER_QUERY, QueueEngine, failure_reason, open_client
from tts2face.serving.work.jobs import DONE, FAILED, JobFile, JobRecord
from tts2face.serving.work.kinds import KINDS, JobCancelledError, JobTask, Product, Products
from tts2face.sound.voice_urls import SERVER_FAILS, failure_of_server
from tts2face.storage.bucket import StoreAwayError
from tts2face.storage.signing import Signer
from tts2face.storage.sql import Database, DatabaseAwayError, connection_errors
from tts2face.storage.temporary import Temporary
from tts2face.storage.user_folders import without_folders

BLOBS, RESOURCES = "results", "resources"  # kinds of files in a store: of jobs, and uploaded models
LOG = logging.getLogger(__name__)
MODEL_SECTIONS = ("models", "request")  # parts of a job's JSON that may name uploads
PAUSE_S = 2.0  # before another try while the database or the store cannot be reached
CHECK_S = 1.0  # between two questions whether a job is still wanted
FULL = f"waits: the disk of the worker has less than {MIN_FREE_BYTES >> 20} MB free; it goes on when there is room"
REPORT_S = 0.5  # between two notes of its progress
# small jobs overtake large ones
SMALLEST_PRIORITY = 10
LARGEST_PRIORITY = 100
SEGMENTS_PER_STEP = 20


def job_blobs(store: str) -> Callable[[], tuple[BlobStore, ...]]:
    """Stores of the files of jobs and of uploaded models; opened when they are first needed."""
    return lru_cache(maxsize=1)(lambda: (open_blobs(store, BLOBS), open_blobs(store, RESOURCES)))


def find_runner(kind: str) -> Callable[[JobTask], Products]:
    """Function that executes the jobs of a kind."""
    if kind not in KINDS:
        raise DataError(f"this worker cannot execute jobs of kind {kind!r}; install the version of the service")
    module, name = KINDS[kind].run.split(":")
    runner: Callable[[JobTask], Products] = getattr(import_module(module), name)
    return runner


class JobRunner:
    """Executes jobs.

    Parameters
    ----------
    url
        URL of the database.
    store
        Store of segments.
    blobs
        Stores of files; the first one is that of jobs.
    signer
        Who signs the results; None: nobody.
    """

    def __init__(
        self, url: str, store: Store, blobs: Callable[[], tuple[BlobStore, ...]], signer: Signer | None = None
    ) -> None:
        self._url = url
        self._store = store
        self._blobs, self._signer = blobs, signer

    def run(self, job_id: str) -> str:
        """Execute a job unless it has ended; its state afterwards.

        While the database or the store cannot be reached, it is tried again; stored segments are not rendered again.
        """
        away: tuple[type[Exception], ...] = (DatabaseAwayError, StoreAwayError, *connection_errors())
        with self._changes() as changes:
            while True:
                try:
                    job = changes.begin(job_id)
                    return "ended" if job is None else self._execute(job, changes)
                except JobCancelledError:
                    return "cancelled"
                except away:
                    time.sleep(PAUSE_S)

    def end_abandoned(self) -> None:
        """End the jobs whose workflow has ended without them, such as after the deaths of all workers that had them."""
        with self._changes() as changes, open_client(self._url) as client:
            names = changes.table.open_jobs()
            for at in range(0, len(names), JOBS_PER_QUERY):
                part = names[at : at + JOBS_PER_QUERY]
                found = {
                    workflow.workflow_id: workflow
                    for workflow in client.list_workflows(workflow_ids=part, load_input=False)
                }
                for name in part:
                    reason = "it was removed from the queue; send it again"
                    if name in found:
                        reason = "" if found[name].status in ACTIVE else failure_reason(found[name])
                    if reason and changes.end(name, Ending(FAILED, error=reason)):
                        changes.forget_inputs(name, self._blobs()[0].delete)

    @contextmanager
    def _changes(self) -> Iterator[JobChanges]:
        database = Database(self._url, n_connections=2)
        try:
            yield JobChanges(database)
        finally:
            database.close()

    def _execute(self, job: JobRecord, changes: JobChanges) -> str:
        scratch = self._store.scratch() or Path(gettempdir())
        watch = JobWatch(job, changes, scratch)
        with Temporary(scratch / "job", is_folder=True) as folder:
            try:
                inputs = {
                    file.name: place_file(self._blobs(), file.sha256, file.name, folder.path / "inputs")
                    for file in job.inputs
                }
                work = folder.path / "work"
                work.mkdir()
                engine = _JobEngine(watch, self._url)
                task = JobTask(
                    self._request(job), inputs, work, engine, self._store, watch.report, watch.check,
                    self._url, lambda: self._blobs()[1], self._signer,
                )  # fmt: skip
                products = find_runner(job.kind)(task)
                ending = Ending(DONE, self._put(products.files), products.error)
                paths = {product.name: product.path for product in products.files}
            # `run` tries these again; they are no fault of the job
            except (DatabaseAwayError, StoreAwayError):
                raise
            except Tts2faceError as wrong:
                ending, paths = Ending(FAILED, error=_for_clients(str(wrong), folder.path)), {}
            self._end(changes, job, ending, paths)
        return ending.state

    def _request(self, job: JobRecord) -> dict[str, Any]:
        """JSON of a job with the paths of uploaded models on this machine."""
        found = dict(job.request)
        for name in MODEL_SECTIONS:
            if name in found:
                found[name] = place_models(found[name], self._blobs)
        if "cast" in found:
            cast = dict(found["cast"])
            default, roles = cast.get("default", {}), cast.get("role", [])
            found["cast"] = {
                "default": place_models(default, self._blobs),
                "role": [place_models(role, self._blobs) for role in roles],
            }
        return found

    def _put(self, products: Sequence[Product]) -> tuple[JobFile, ...]:
        store = self._blobs()[0]
        return tuple(
            JobFile(
                product.name,
                wait_for_store(partial(store.put, product.path), _ignore),
                product.media_type,
                product.path.stat().st_size,
            )
            for product in products
        )

    def _end(self, changes: JobChanges, job: JobRecord, ending: Ending, paths: Mapping[str, Path]) -> None:
        """End a job, whose results are in the store then even if another job's deletion has removed equal ones."""
        store = self._blobs()[0]

        def put_missing(files: Sequence[JobFile]) -> None:
            for file in files:
                if not store.has(file.sha256):
                    store.put(paths[file.name])

        # it was cancelled or deleted meanwhile: nobody would fetch its results
        if not changes.end(job.id, ending, put_missing):
            changes.remove_unused({file.sha256 for file in ending.outputs}, store.delete)
        changes.forget_inputs(job.id, store.delete)


class JobWatch:
    """Progress of a job, why it waits, and whether it is still wanted.

    Parameters
    ----------
    folder
        On the disk on which it works.
    """

    def __init__(self, job: JobRecord, changes: JobChanges, folder: Path) -> None:
        self.job_id = job.id
        self.changes = changes
        self._folder = folder
        self._checked_at = self._reported_at = 0.0
        self._is_paused = job.error is not None  # by a worker that has died since

    def check(self) -> None:
        """Raise `JobCancelledError` if the job has ended or was deleted; asks at most once in `CHECK_S`.

        It also notes in the job that the disk has less than `MIN_FREE_BYTES`, where the rendering waits for room.
        """
        if time.monotonic() - self._checked_at > CHECK_S:
            self._checked_at = time.monotonic()
            if not self.changes.is_open(self.job_id):
                raise JobCancelledError
            is_full = free_bytes(self._folder) < MIN_FREE_BYTES
            if is_full != self._is_paused:
                self.changes.pause(self.job_id, FULL if is_full else None)
                self._is_paused = is_full

    def report(self, content: dict[str, Any]) -> None:
        """Add an event; of progress only some."""
        # the end of a bar is always shown
        is_last = content.get("done") == content.get("of")
        if "done" in content and not is_last and time.monotonic() - self._reported_at < REPORT_S:
            return
        self._reported_at = time.monotonic()
        if not self.changes.report(self.job_id, content):
            raise JobCancelledError


@dataclass(frozen=True, slots=True)
class _JobEngine:
    """Queues the segments of a job for all workers."""

    watch: JobWatch
    url: str

    def render(self, segments: Mapping[str, Segment], store: Store) -> Iterator[Rendered]:
        """Yield each segment as soon as it is stored or has failed."""
        self.watch.check()
        # before they are queued, so that the job's cancellation finds them
        self.watch.changes.note_segments(self.watch.job_id, segments)
        # short jobs first: a clip must not wait for a film that came before it
        priority = min(SMALLEST_PRIORITY + len(segments) // SEGMENTS_PER_STEP, LARGEST_PRIORITY)
        yield from QueueEngine(self.url, priority, on_wait=self.watch.check).render(segments, store)


def _for_clients(message: str, folder: Path) -> str:
    """A message without the paths of this machine, and without the address of a voice server."""
    if (reason := failure_of_server(message)) is not None:
        LOG.warning("voice server failed", extra={"fields": {"reason": reason}})
        return SERVER_FAILS
    return without_folders(message, [*(folder / "inputs").glob("*"), folder]).replace(str(folder), "the job")


def _ignore(_: str) -> None:
    """Nobody reads these messages."""
