"""Computation ahead of use: items of an iterable in one thread, a function of items in several threads.

Results of finished sentences, kept so that a request that is made again repeats only what has changed.

Models that are read once, and what is computed of them alone: all sessions of a process share them.
"""

import contextlib
import os
import queue
import threading
import weakref
from collections import OrderedDict, deque
from collections.abc import Callable, Hashable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from functools import cache, wraps
from pathlib import Path
from types import TracebackType
from typing import Any, Generic, ParamSpec, TypeVar

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


Value = TypeVar("Value")


class SentenceMemory:
    """Values by key up to a number of bytes; the least recently used ones are dropped. Thread-safe.

    Parameters
    ----------
    max_bytes
        Largest total of the sizes that `recall` is given; 0 keeps nothing.
    """

    def __init__(self, max_bytes: int) -> None:
        self._max_bytes = max_bytes
        self._lock = threading.Lock()
        self._values: OrderedDict[Hashable, tuple[Any, int]] = OrderedDict()
        self._n_bytes = 0

    @property
    def is_used(self) -> bool:
        """Whether anything is kept."""
        return self._max_bytes > 0

    @property
    def n_bytes(self) -> int:
        """Total of the sizes of the values that are kept."""
        return self._n_bytes

    def recall(self, key: Callable[[], Hashable], make: Callable[[], Value], size: Callable[[Value], int]) -> Value:
        """The kept value of a key, or a new one, which is kept if it is small enough."""
        if not self.is_used:
            return make()
        found = key()
        with self._lock:
            if found in self._values:
                self._values.move_to_end(found)
                kept: Value = self._values[found][0]
                return kept
        value = make()
        n_bytes = size(value)
        with self._lock:
            if found not in self._values and n_bytes <= self._max_bytes:
                self._values[found] = (value, n_bytes)
                self._n_bytes += n_bytes
                while self._n_bytes > self._max_bytes:
                    self._n_bytes -= self._values.popitem(last=False)[1][1]
        return value


NO_MEMORY = SentenceMemory(0)  # keeps nothing


N_KEPT = 4  # values of each kind that stay in memory though nobody holds them; a face takes about 50 MB


class Shared(Generic[Value]):
    """Read-only values by key, of which there is one at a time. Thread-safe: one thread makes a value, others wait.

    A value stays as long as anybody holds it, and the last `N_KEPT` stay until `free_unused`.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._values: weakref.WeakValueDictionary[Hashable, Any] = weakref.WeakValueDictionary()
        self._kept: OrderedDict[Hashable, Any] = OrderedDict()
        self._making: dict[Hashable, threading.Lock] = {}
        _EVERY.append(self)

    def get(self, key: Hashable, make: Callable[[], Value]) -> Value:
        """The value of a key; a new one where there is none, or none is left."""
        with self._lock:
            making = self._making.setdefault(key, threading.Lock())
        try:
            with making:
                found = self._values.get(key)
                value: Value = make() if found is None else found
                with self._lock:
                    self._values[key] = self._kept[key] = value
                    self._kept.move_to_end(key)
                    while len(self._kept) > N_KEPT:
                        self._kept.popitem(last=False)
        finally:
            with self._lock:
                self._making.pop(key, None)
        return value

    def free_unused(self) -> None:
        """Keep only what others hold."""
        with self._lock:
            kept, self._kept = self._kept, OrderedDict()
        del kept  # outside the lock: it may be much


_EVERY: list[Shared[Any]] = []


def free_unused() -> None:
    """Free the models that no session holds; those that hold themselves in circles with the next garbage collection."""
    for shared in _EVERY:
        shared.free_unused()


def file_state(path: Path) -> Hashable:
    """What changes when a file or folder is written again or replaced; without one, its path alone."""
    try:
        status = path.stat()
    except (OSError, ValueError):  # whoever reads it tells what is wrong
        return str(path)
    return os.path.realpath(path), status.st_mtime_ns, status.st_size, status.st_ino


Arguments = ParamSpec("Arguments")


def shared(function: Callable[Arguments, Value]) -> Callable[Arguments, Value]:
    """A function of models, whose result all share who ask for that of the same objects."""
    values: Shared[Value] = Shared()

    @wraps(function)
    def find(*arguments: Arguments.args, **options: Arguments.kwargs) -> Value:
        key = (*map(_identity, arguments), *((name, _identity(value)) for name, value in sorted(options.items())))
        return values.get(key, lambda: function(*arguments, **options))

    return find


def _identity(value: Any) -> Hashable:
    """A plain value, or an object itself, which is not kept by this."""
    return value if value is None or isinstance(value, bool | int | float | str) else weakref.ref(value)
