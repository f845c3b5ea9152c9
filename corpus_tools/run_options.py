"""Options of long computations that do not affect results: cache folder, processes, model files.

Parallel work in processes with an initialiser.
"""

import os
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, TypeVar

from lexicon.errors import BackendError, InputError
from lexicon.values.fields import check_fields
from tts2face.processes.child import exit_after
from tts2face.storage.files import user_cache
from tts2face.types import Progress

StageCallback = Callable[[str], Progress]  # name of a stage -> its progress callback


@dataclass(frozen=True, slots=True)
class RunOptions:
    """Options of a run that do not change its result.

    ``cache`` is the folder for intermediate results (the user's cache when None), ``jobs`` the number of processes (one
    per core when None), ``model`` the bundle of landmark models (found when None).
    """

    cache: Path | None = None
    jobs: int | None = None
    model: Path | None = None

    def __post_init__(self) -> None:
        """Refuse values of other types (`InputError`)."""
        check_fields(self)

    def folder(self) -> Path:
        """The cache folder, created if necessary.

        Raises
        ------
        BackendError
            The folder cannot be written.
        """
        folder = self.cache or user_cache() / "recordings"
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as refused:
            raise BackendError(f"cannot write {folder}: {refused.strerror}; choose another cache folder") from refused
        return folder

    def n_processes(self) -> int:
        """Number of processes.

        Raises
        ------
        InputError
            ``jobs`` is below 1.
        """
        jobs = (os.cpu_count() or 1) if self.jobs is None else self.jobs
        if jobs < 1:
            raise InputError(f"jobs must be 1 or more, not {jobs}")
        return jobs


def ignore_stage(_: str) -> Progress:
    """Stage callback that ignores progress."""
    return lambda done, of: None


Task = TypeVar("Task")
Result = TypeVar("Result")


def map_unordered(
    tasks: Sequence[Task], work: Callable[[Task], Result], start: Callable[..., None], ready: tuple[Any, ...], jobs: int
) -> Iterator[tuple[Task, Result]]:
    """Yield tasks with their results in order of completion; every process calls ``start(*ready)`` once.

    The processes end immediately if the caller stops early, by an error or an interruption, and if this process dies.

    Raises
    ------
    BackendError
        A process died.
    """
    context = get_context("spawn")
    ends, alive = context.Pipe(duplex=False)  # carries no data: its end signals the death of this process
    pool = ProcessPoolExecutor(jobs, mp_context=context, initializer=_initialise, initargs=(ends, start, ready))
    try:
        waiting = {pool.submit(work, task): task for task in tasks}
        for future in as_completed(waiting):
            yield waiting[future], future.result()
        pool.shutdown()
    except BrokenProcessPool as died:
        raise BackendError(
            "a worker process died; run the command again with fewer jobs (finished recordings are cached)"
        ) from died
    finally:
        alive.close()  # ends processes that are still working
        pool.shutdown(cancel_futures=True)
        ends.close()


def _initialise(ends: Connection, start: Callable[..., None], ready: tuple[Any, ...]) -> None:
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):  # also sent to the process group; the parent stops the pool
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    exit_after(ends.recv_bytes)
    start(*ready)
