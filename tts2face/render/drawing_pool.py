"""Pictures drawn side by side, one thread each, and handed on in order."""

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

Item = TypeVar("Item")
Drawn = TypeVar("Drawn")


def drawn_ahead(draw: Callable[[Item], Drawn], items: Iterable[Item], threads: int) -> Iterator[Drawn]:
    """What `draw` makes of each item, in order; as many are drawn ahead as there are threads, the rest not yet."""
    with ThreadPoolExecutor(threads, "draw") as pool:
        ahead: deque[Future[Drawn]] = deque()
        try:
            for item in items:
                ahead.append(pool.submit(draw, item))
                if len(ahead) > threads:
                    yield ahead.popleft().result()
            while ahead:
                yield ahead.popleft().result()
        finally:
            for waiting in ahead:
                waiting.cancel()
