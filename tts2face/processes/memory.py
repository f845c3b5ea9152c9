"""Results of finished sentences, kept so that a request that is made again repeats only what has changed."""

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable
from typing import Any, TypeVar

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
