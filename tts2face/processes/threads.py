"""Computation ahead of use: items of an iterable in one thread, a function of items in several threads."""

import contextlib
import os
import queue
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from functools import cache
from types import TracebackType
from typing import Any, Generic, TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")
ItemOrError = tuple[Any, BaseException | None]
POLL_INTERVAL_S = 0.1  # longest time until the producer thread notices that it has been stopped


class Prefetch(Generic[Item]):
    """Iterator over a source whose items are produced in a background thread.

    Production starts and stops with the ``with`` block. An exception of the source is raised in place of the item that
    failed. The thread is no daemon: a process that exits while native code is running in one aborts.

    Parameters
    ----------
    source
        Items, produced in order.
    n_ahead
        Largest number of items that are produced before they are requested.
    """

    def __init__(self, source: Iterable[Item], n_ahead: int) -> None:
        self._source = source
        self._queue: queue.Queue[ItemOrError] = queue.Queue(n_ahead)
        self._stopped = threading.Event()
        self._thread = threading.Thread(target=self._fill, name="prefetch")

    def __enter__(self) -> "Prefetch[Item]":
        """Start production; return the iterator itself."""
        try:
            self._thread.start()
        except BaseException:  # an interruption, after which the thread runs or not
            self._stopped.set()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Wait until the current item is finished."""
        self._stopped.set()
        self._thread.join()

    def __iter__(self) -> Iterator[Item]:
        """Yield the items in order."""
        while True:
            item, error = self._queue.get()
            if isinstance(error, StopIteration):
                return
            if error is not None:
                raise error
            yield item

    def _fill(self) -> None:
        try:
            for item in self._source:
                self._put((item, None))
                if self._stopped.is_set():
                    return
            self._put((None, StopIteration()))
        except BaseException as error:  # noqa: BLE001 - raised again in the consuming thread
            self._put((None, error))

    def _put(self, item: ItemOrError) -> None:
        while not self._stopped.is_set():
            # a consumer that has stopped never takes an item: the wait has an end
            with contextlib.suppress(queue.Full):
                return self._queue.put(item, timeout=POLL_INTERVAL_S)


def available_cores() -> int:
    """Number of processor cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@cache
def _pool(threads: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(threads, "map")


def map_in_order(
    function: Callable[[Item], Result], items: Iterable[Item], threads: int | None = None
) -> Iterator[Result]:
    """Yield `function` of each item in order.

    Parameters
    ----------
    threads
        Number of results that are computed in advance, in as many threads, which all maps of this number share; None:
        one for each core.
    """
    n_ahead, ahead = threads or available_cores(), deque[Future[Result]]()
    pool = _pool(n_ahead)
    try:
        for item in items:
            ahead.append(pool.submit(function, item))
            if len(ahead) > n_ahead:
                yield ahead.popleft().result()
        while ahead:
            yield ahead.popleft().result()
    finally:
        for pending in ahead:
            pending.cancel()
