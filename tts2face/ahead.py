"""Work done a little ahead of its use, in a thread of its own."""

import contextlib
import queue
import threading
from collections.abc import Generator, Iterable
from typing import Any, TypeVar

Item = TypeVar("Item")
Offer = tuple[Any, BaseException | None]
PATIENCE_S = 0.1  # how soon the maker notices that nobody wants its items any more


class _Maker(threading.Thread):
    """Takes items from a source and offers each, until there is none, one fails, or it is told to stop."""

    def __init__(self, source: Iterable[Any], room: int) -> None:
        super().__init__(name="ahead", daemon=True)
        self.items: queue.Queue[Offer] = queue.Queue(room)
        self.stopped = threading.Event()
        self._source = source

    def run(self) -> None:
        try:
            for item in self._source:
                self._offer((item, None))
                if self.stopped.is_set():
                    return
            self._offer((None, StopIteration()))
        except BaseException as error:  # noqa: BLE001 - raised again in the thread that asked
            self._offer((None, error))

    def _offer(self, item: Offer) -> None:
        while not self.stopped.is_set():
            with contextlib.suppress(queue.Full):
                return self.items.put(item, timeout=PATIENCE_S)


def made_ahead(source: Iterable[Item], room: int) -> Generator[Item, None, None]:
    """The same items in the same order; up to `room` of them are made before they are asked for.

    An error of the source is raised here, where its item would have come.
    """
    maker = _Maker(source, room)
    maker.start()
    try:
        while True:
            item, error = maker.items.get()
            if isinstance(error, StopIteration):
                return
            if error is not None:
                raise error
            yield item
    finally:
        maker.stopped.set()
