"""Calls of one process wait for other threads and processes while others have turns, and compute one by one."""

import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from functools import partial
from typing import Any

import numpy as np
import pytest

from tests.running import eventually
from tests.serving.service.calls import WAIT_S, Calls
from tts2face.processes.child import StoppedError
from tts2face.processes.message import MORE, STOP
from tts2face.serving.service.messages import Step
from tts2face.serving.service.scheduler import InterruptedTaskError, OneAtATime, wait_elsewhere
from tts2face.sound.alignment import Aligner
from tts2face.sound.voice_pool import VoicePool, load_voice
from tts2face.types import Chunk


class Elsewhere:
    """What another thread or process does for a call: its end is that of the future."""

    def __init__(self) -> None:
        self.future: Future[int] = Future()
        self.n_ends = 0

    def end(self) -> None:
        self.n_ends += 1

    def steps(self, released: list[str]) -> Iterator[Step]:
        try:
            yield Chunk(b"before")
            try:
                number = wait_elsewhere(self.future, self.end)
            except InterruptedTaskError:
                yield Chunk(b"interrupted")
            else:
                yield Chunk(b"%d" % number)
        finally:
            released.append("all")


def payloads(calls: Calls, id: int) -> list[bytes]:
    return [one.payload for one in calls.sent if one.id == id]


def test_others_have_turns_while_a_call_waits(calls: Calls) -> None:
    elsewhere = Elsewhere()
    calls.start(1, lambda: elsewhere.steps([]))
    calls.start(2, lambda: calls.speech(2))
    calls.end(2)
    assert payloads(calls, 1) == [b"before"]
    elsewhere.future.set_result(7)
    calls.end(1)
    assert payloads(calls, 1) == [b"before", b"7"]
    assert elsewhere.n_ends == 0


@pytest.mark.parametrize("is_begun", [False, True])
def test_a_call_that_is_stopped_while_it_waits_ends_what_it_waits_for(calls: Calls, is_begun: bool) -> None:
    elsewhere, released = Elsewhere(), list[str]()
    if is_begun:
        elsewhere.future.set_running_or_notify_cancel()
    calls.start(1, lambda: elsewhere.steps(released))
    calls.control(1, STOP)
    assert isinstance(calls.end(1), StoppedError)
    assert (released, payloads(calls, 1)) == (["all"], [b"before"])
    assert (elsewhere.n_ends, elsewhere.future.cancelled()) == (int(is_begun), not is_begun)


def test_an_interrupted_call_goes_on(calls: Calls) -> None:
    elsewhere = Elsewhere()
    calls.start(1, lambda: elsewhere.steps([]))
    calls.control(1, MORE, type="cancel")
    calls.end(1)
    assert payloads(calls, 1) == [b"before", b"interrupted"]


def test_a_call_is_interrupted_before_its_turn_after_a_wait(calls: Calls, held: threading.Event) -> None:
    """As between two steps of a piece, where the wait is over at once."""
    elsewhere = Elsewhere()
    calls.start(1, lambda: elsewhere.steps([]))
    elsewhere.future.set_result(7)
    calls.control(1, MORE, type="cancel")
    held.set()
    calls.end(1)
    assert payloads(calls, 1) == [b"before", b"interrupted"]
    assert elsewhere.n_ends == 0


def test_without_turns_a_wait_is_a_wait() -> None:
    elsewhere = Elsewhere()
    elsewhere.future.set_result(7)
    assert wait_elsewhere(elsewhere.future, elsewhere.end) == 7


def test_calls_run_models_one_after_another(calls: Calls) -> None:
    run, end = OneAtATime(), threading.Event()
    order: list[int] = []

    def task(number: int) -> Iterator[Step]:
        yield Chunk(b"begun")
        run(lambda: (order.append(number), end.wait(WAIT_S)), end.set)
        yield Chunk(b"done")

    for number in (1, 2, 3):
        calls.start(number, partial(task, number))
    eventually(lambda: order, WAIT_S)
    calls.control(2, STOP)  # while it waits for the first one
    assert isinstance(calls.end(2), StoppedError)
    assert order == [1]
    end.set()
    calls.end(1)
    calls.end(3)
    assert order == [1, 3]


def test_voices_of_a_pool_share_an_aligner_whose_work_is_done_in_turn() -> None:
    run: list[str] = []

    def count(compute: Callable[[], Any], end: Callable[[], None]) -> Any:
        run.append(threading.current_thread().name)
        return compute()

    align = VoicePool(count)._align
    assert align is not None
    sound = load_voice("heart", "en-us").speak("Bob may read.").waveform
    words = [("Bob", [("b", "ɑ", "b")]), ("may", [("m", "eɪ")]), ("read.", [("ɹ", "i", "d")])]
    np.testing.assert_array_equal(align(sound, words).phones.edges, Aligner().align(sound, words).phones.edges)
    assert len(run) == 1
