"""Parallel work in processes, each of which loads once what its tasks need."""

import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context
from multiprocessing.connection import Connection
from typing import Any, TypeVar

from lexicon.errors import BackendError
from tts2face.processes.child import exit_after

Task = TypeVar("Task")
Result = TypeVar("Result")
_workers: list[Callable[[Any], Any]] = []  # of this process; filled once by the pool


def map_unordered(
    tasks: Sequence[Task], make_worker: Callable[..., Callable[[Task], Result]], ready: tuple[Any, ...], jobs: int
) -> Iterator[tuple[Task, Result]]:
    """Yield tasks with their results in order of completion.

    Every process calls ``make_worker(*ready)`` once, and what it returns for each of its tasks; with one job, this
    process does so. The processes end immediately if the caller stops early, by an error or an interruption, and if
    this process dies.

    Raises
    ------
    BackendError
        A process died.
    """
    if jobs <= 1:
        worker = make_worker(*ready)
        for task in tasks:
            yield task, worker(task)
        return
    context = get_context("spawn")
    ends, alive = context.Pipe(duplex=False)  # carries no data: its end signals the death of this process
    pool = ProcessPoolExecutor(jobs, mp_context=context, initializer=_initialise, initargs=(ends, make_worker, ready))
    try:
        waiting = {pool.submit(_work, task): task for task in tasks}
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


def _initialise(ends: Connection, make_worker: Callable[..., Callable[[Any], Any]], ready: tuple[Any, ...]) -> None:
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):  # also sent to the process group; the parent stops the pool
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    exit_after(ends.recv_bytes)
    _workers.append(make_worker(*ready))


def _work(task: Any) -> Any:
    return _workers[0](task)
