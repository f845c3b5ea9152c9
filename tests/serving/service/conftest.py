"""Calls of one process, and a turn that is held, for tests of turns."""

import threading
from collections.abc import Iterator

import pytest

from tests.serving.service.calls import WAIT_S, Calls
from tts2face.serving.service.messages import Step


@pytest.fixture
def calls() -> Calls:
    return Calls()


@pytest.fixture
def held(calls: Calls) -> Iterator[threading.Event]:
    """A turn that ends when the event is set, so that calls begin to wait in the order of their start."""
    end = threading.Event()

    def hold() -> Iterator[Step]:
        begun.set()
        end.wait(WAIT_S)
        yield from ()

    begun = threading.Event()
    thread = threading.Thread(target=calls.start, args=(0, hold), daemon=True)
    thread.start()
    assert begun.wait(WAIT_S)
    yield end
    end.set()
    thread.join()
