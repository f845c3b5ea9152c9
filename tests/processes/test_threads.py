"""Work done ahead of its use."""

import threading
import time
from collections.abc import Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from tts2face.picture.encoder_thread import EncoderThread
from tts2face.processes.threads import Prefetch


def test_same_items_in_the_same_order() -> None:
    with Prefetch(range(50), 3) as items:
        assert list(items) == list(range(50))


def test_no_more_items_than_the_limit_are_prefetched() -> None:
    made: list[int] = []

    def source() -> Iterator[int]:
        for number in range(100):
            made.append(number)
            yield number

    with Prefetch(source(), 2) as items:
        assert next(iter(items)) == 0
        time.sleep(0.3)
        assert 3 <= len(made) <= 5


def test_an_error_is_raised_in_place_of_its_item() -> None:
    def source() -> Iterator[int]:
        yield 1
        raise ValueError("broken")

    with Prefetch(source(), 2) as ahead:
        items = iter(ahead)
        assert next(items) == 1
        with pytest.raises(ValueError, match="broken"):
            next(items)


def test_an_interruption_while_threads_start_leaves_none(monkeypatch: pytest.MonkeyPatch) -> None:
    start = threading.Thread.start

    def interrupted_start(thread: threading.Thread) -> None:
        start(thread)
        raise KeyboardInterrupt

    before = set(threading.enumerate())
    with monkeypatch.context() as patched:
        patched.setattr(threading.Thread, "start", interrupted_start)
        with pytest.raises(KeyboardInterrupt), Prefetch(iter(int, 1), 1):  # endless
            pass
        with pytest.raises(KeyboardInterrupt):
            EncoderThread(NoSink())
    for thread in set(threading.enumerate()) - before:
        assert not thread.daemon  # a process that exits while native code runs in a daemon thread aborts
        thread.join(5.0)
        assert not thread.is_alive()


class NoSink:
    """Sink that is never given anything."""

    def picture(self, pixels: NDArray[np.uint8]) -> None:
        raise AssertionError("a picture was written")

    def sound(self, samples: NDArray[np.float32]) -> None:
        raise AssertionError("sound was written")

    def finish(self) -> None:
        raise AssertionError("the output was completed")

    def abandon(self) -> None:
        raise AssertionError("the output was closed")


def test_the_producer_ends_when_the_consumer_stops() -> None:
    before = threading.active_count()
    with Prefetch(iter(int, 1), 1) as items:  # endless
        next(iter(items))
    time.sleep(0.5)
    assert threading.active_count() <= before
