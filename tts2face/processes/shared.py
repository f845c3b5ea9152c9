"""Models that are read once, and what is computed of them alone: all sessions of a process share them."""

import os
import threading
import weakref
from collections import OrderedDict
from collections.abc import Callable, Hashable
from functools import wraps
from pathlib import Path
from typing import Any, Generic, ParamSpec, TypeVar

Value = TypeVar("Value")
Arguments = ParamSpec("Arguments")

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
    """State that changes when a file or folder is written again or replaced; without one, its path alone."""
    try:
        status = path.stat()
    # a ValueError: a path with a zero byte
    except (OSError, ValueError):  # whoever reads it says what is wrong
        return str(path)
    return os.path.realpath(path), status.st_mtime_ns, status.st_size, status.st_ino


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
