"""Results in memory by what determines them, so that what is made again repeats only what has changed."""

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable
from typing import Any, TypeVar

Value = TypeVar("Value")


class ResultMemory:
    """Values by key up to a number of bytes; the least recently used ones are dropped. Thread-safe.

    Parameters
    ----------
    max_bytes
        Largest total of the sizes that are given; 0 keeps nothing.
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

    def get(self, key: Hashable) -> Any:
        """Value of a key; None if it is not kept."""
        with self._lock:
            if key not in self._values:
                return None
            self._values.move_to_end(key)
            return self._values[key][0]

    def put(self, key: Hashable, value: Any, n_bytes: int) -> None:
        """Keep a value, and whatever its size until the next one."""
        with self._lock:
            if key not in self._values:
                self._n_bytes += n_bytes
                self._values[key] = (value, n_bytes)
            self._values.move_to_end(key)
            while self._n_bytes > self._max_bytes and len(self._values) > 1:
                self._n_bytes -= self._values.popitem(last=False)[1][1]

    def recall(self, key: Callable[[], Hashable], make: Callable[[], Value], size: Callable[[Value], int]) -> Value:
        """The kept value of a key, or a new one, which is kept if it is small enough."""
        if not self.is_used:
            return make()
        found = key()
        kept: Value | None = self.get(found)
        if kept is not None:
            return kept
        value = make()
        n_bytes = size(value)
        if n_bytes <= self._max_bytes:
            self.put(found, value, n_bytes)
        return value


NO_MEMORY = ResultMemory(0)  # keeps nothing
