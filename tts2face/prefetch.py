"""Work done before its result is needed: the items of a source in one thread, a function of items in several."""

import contextlib
import queue
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from types import TracebackType
from typing import Any, Generic, TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")
ItemOrError = tuple[Any, BaseException | None]
POLL_INTERVAL_S = 0.1  # how soon the maker notices that nobody wants its items any more


class Prefetch(Generic[Item]):
    """The items of a source in their order; up to `room` of them are made before they are asked for.

    Making begins at once and ends with the ``with`` block. An error of the source is raised where its item would come.
    """

    def __init__(self, source: Iterable[Item], room: int) -> None:
        self._source = source
        self._made: queue.Queue[ItemOrError] = queue.Queue(room)
        self._stopped = threading.Event()
        self._thread = threading.Thread(target=self._fill, name="prefetch", daemon=True)
        self._thread.start()

    def __enter__(self) -> "Prefetch[Item]":
        """Give the items."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Let the maker finish the item at hand and end: a process that ends around running native code aborts."""
        self._stopped.set()
        self._thread.join()

    def __iter__(self) -> Iterator[Item]:
        """Items in their order."""
        while True:
            item, error = self._made.get()
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
        except BaseException as error:  # noqa: BLE001 - raised again in the thread that asked
            self._put((None, error))

    def _put(self, item: ItemOrError) -> None:
        while not self._stopped.is_set():
            with contextlib.suppress(queue.Full):
                return self._made.put(item, timeout=POLL_INTERVAL_S)


def map_in_order(function: Callable[[Item], Result], items: Iterable[Item], threads: int) -> Iterator[Result]:
    """`function` of each item, in order, computed in several threads, as many in advance as there are threads."""
    with ThreadPoolExecutor(threads, "map") as pool:
        ahead: deque[Future[Result]] = deque()
        try:
            for item in items:
                ahead.append(pool.submit(function, item))
                if len(ahead) > threads:
                    yield ahead.popleft().result()
            while ahead:
                yield ahead.popleft().result()
        finally:
            for waiting in ahead:
                waiting.cancel()
