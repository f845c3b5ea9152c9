"""Work shared among processes that each make something ready first."""

import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context
from typing import Any, TypeVar

from lexicon.errors import BackendError

Task = TypeVar("Task")
Result = TypeVar("Result")


def each_done(
    tasks: Sequence[Task], work: Callable[[Task], Result], start: Callable[..., None], ready: tuple[Any, ...], jobs: int
) -> Iterator[tuple[Task, Result]]:
    """Tasks with their results as they come, in no order; every process calls ``start(*ready)`` once.

    Raises
    ------
    BackendError
        A process died.
    """
    pool = ProcessPoolExecutor(jobs, mp_context=get_context("spawn"), initializer=_begin, initargs=(start, ready))
    try:
        waiting = {pool.submit(work, task): task for task in tasks}
        for future in as_completed(waiting):
            yield waiting[future], future.result()
    except BrokenProcessPool as died:
        raise BackendError(
            "a process that read recordings died; run the command again (it goes on), with fewer jobs"
        ) from died
    finally:
        pool.shutdown(cancel_futures=True)


def _begin(start: Callable[..., None], ready: tuple[Any, ...]) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent stops the pool
    start(*ready)
