"""Calls of one process take turns: their order, keys, priorities, pauses and ends."""

import threading
from collections.abc import Iterator
from functools import partial
from typing import Any

import pytest

from lexicon.errors import InputError
from tests.processes.answered import answered
from tests.running import eventually
from tests.serving.service.calls import WAIT_S, Calls
from tts2face.processes.child import StoppedError
from tts2face.processes.message import ERROR, GO, MORE, PAUSE, STOP
from tts2face.serving.service.messages import Event, Step, Wait, Work
from tts2face.serving.service.scheduler import OneAtATime
from tts2face.serving.service.synthesis import Synthesis
from tts2face.session.session_cache import SessionCache
from tts2face.types import Chunk


def test_the_result_of_a_call_is_sent_in_order(calls: Calls) -> None:
    calls.start(7, lambda: calls.speech(3))
    assert calls.end(7) == {"seconds": 3.0, "cpu_s": pytest.approx(0.3)}
    assert [(one.id, one.content, one.payload) for one in calls.sent] == [
        (7, {"seconds": 1.0}, bytes([number])) for number in range(3)
    ]


def test_a_new_call_begins_before_one_that_is_ahead_continues(calls: Calls) -> None:
    def first() -> Iterator[Step]:
        yield from calls.speech(4)
        threading.Thread(target=calls.start, args=(2, lambda: calls.speech(10))).start()
        eventually(lambda: calls.n_waiting(2), WAIT_S)
        yield from calls.speech(6)

    calls.start(1, first)
    calls.end(1)
    calls.end(2)
    assert calls.order[:10] == [1] * 5 + [2] * 5  # until both are equally far ahead of their listeners
    assert set(calls.order[10:14]) == {1, 2}


def test_keys_share_the_turns(calls: Calls, held: threading.Event) -> None:
    """Ten calls of a key have together as many turns as one of another key."""
    for id in range(1, 11):
        calls.start(id, lambda: calls.speech(20, seconds=0.01), key="a")
    calls.start(11, lambda: calls.speech(20, seconds=0.01), key="b")
    held.set()
    calls.end(11)
    order = calls.order[: 1 + max(at for at, id in enumerate(calls.order) if id == 11)]
    assert abs(order.count(11) - sum(id != 11 for id in order)) <= 2
    for id in range(1, 11):
        calls.end(id)


def test_a_key_that_was_idle_has_a_short_credit_and_no_more(calls: Calls) -> None:
    """However long it was idle: its first turns follow one another, then the keys alternate."""

    def first() -> Iterator[Step]:
        yield from calls.speech(100, seconds=0.001)
        threading.Thread(target=calls.start, args=(2, lambda: calls.speech(40, seconds=0.001), 0, "b")).start()
        eventually(lambda: calls.n_waiting(2), WAIT_S)
        yield from calls.speech(40, seconds=0.001)

    calls.start(1, first, key="a")
    calls.end(1)
    eventually(lambda: 2 in calls.results, WAIT_S)
    later = calls.order[101:]
    n_first = later.index(1)  # turns of a tenth of a second
    assert 9 <= n_first <= 12
    assert abs(later[n_first : n_first + 20].count(1) - 10) <= 1


def test_a_call_that_is_ahead_of_its_listener_gives_way_to_another_key(calls: Calls, held: threading.Event) -> None:
    """Also one of the key for which less has been computed."""
    calls.start(1, lambda: calls.speech(5, seconds=100.0), key="a")
    calls.start(2, lambda: calls.speech(5, seconds=0.01), key="b")
    held.set()
    calls.end(1)
    calls.end(2)
    assert calls.order == [1, 2, 2, 2, 2, 2, 1, 1, 1, 1]


def test_cancelling_again_and_again_takes_no_turns_of_another_key(calls: Calls, held: threading.Event) -> None:
    def interrupted() -> Iterator[Step]:
        for _ in range(20):
            calls.now += 0.1
            calls.control(1, MORE, type="cancel")
            yield Chunk(b"sound", 0.01)

    calls.start(1, interrupted, key="a")
    calls.start(2, lambda: calls.speech(20, seconds=0.01), key="b")
    held.set()
    calls.end(1)
    calls.end(2)
    assert abs(calls.order[:20].count(1) - 10) <= 1


def test_computations_of_keys_take_turns() -> None:
    """Of twenty of one key and one of another, the last one is not the last that is done."""
    calls, native, begin = Calls(), OneAtATime(), threading.Event()
    done: list[int] = []

    def computing(id: int) -> Iterator[Step]:
        yield Event({})
        native(lambda: (begin.wait(WAIT_S), done.append(id)), lambda: None)
        yield Chunk(b"sound", 0.01)

    for id in range(21):
        calls.start(id, partial(computing, id), key="b" if id == 20 else "a")
        eventually(lambda n=id: len(native._waiting) == n, WAIT_S)  # type: ignore[misc]
    begin.set()
    for id in range(21):
        calls.end(id)
    assert done.index(20) <= 1


def test_calls_of_lower_priority_run_when_no_other_can(calls: Calls, held: threading.Event) -> None:
    calls.start(1, lambda: calls.speech(2), priority=1)
    calls.start(2, lambda: calls.speech(2, seconds=100.0))
    held.set()
    calls.end(1)
    assert calls.order == [2, 2, 1, 1]


def test_a_paused_call_waits(calls: Calls, held: threading.Event) -> None:
    calls.start(1, lambda: calls.speech(2))
    calls.start(2, lambda: calls.speech(2))
    calls.control(1, PAUSE)
    held.set()
    calls.end(2)
    assert calls.order == [2, 2]
    calls.control(1, GO)
    calls.end(1)
    assert calls.order == [2, 2, 1, 1]


def test_a_call_without_input_waits_until_it_gets_some(calls: Calls) -> None:
    def listens() -> Iterator[Step]:
        yield Wait(0.01)
        yield Event({"waited": 0.01})
        yield Wait()
        yield Event({"heard": True}, 0.5)

    calls.start(1, listens)
    eventually(lambda: calls.sent, WAIT_S)
    calls.control(1, MORE, type="text")
    assert calls.end(1)["seconds"] == 0.5
    assert [one.content["event"] for one in calls.sent] == [{"waited": 0.01}, {"heard": True}]


def test_a_call_with_an_urgent_input_runs_next(calls: Calls, held: threading.Event) -> None:
    """Until it has read it, even if it is ahead, and of a lower priority."""

    def interrupted() -> Iterator[Step]:
        yield Chunk(b"sound", 100.0)
        calls._calls[1].inputs.popleft()
        yield Event({"type": "cancelled"})
        yield Event({"type": "later"})

    calls.start(1, interrupted, priority=1)
    calls.start(2, lambda: calls.speech(2))
    calls.control(1, MORE, type="cancel")
    held.set()
    calls.end(1)
    assert calls.order == [1, 1, 2, 2, 1]


def test_a_stopped_call_releases_what_it_holds_in_the_next_turn(calls: Calls, held: threading.Event) -> None:
    def holds() -> Iterator[Step]:
        try:
            yield Chunk(b"sound")
            calls.control(1, STOP)
            yield from calls.speech(9)
        finally:
            calls.control(2, GO)  # the other one still waits for its turn
            released.append(calls.n_waiting(2))

    released: list[int] = []
    calls.start(1, holds, priority=-1)
    calls.start(2, lambda: calls.speech(2))
    calls.control(2, PAUSE)
    held.set()
    assert isinstance(calls.end(1), StoppedError)
    calls.end(2)
    assert released == [1]
    assert calls.order == [1, 1, 2, 2]


@pytest.mark.parametrize(
    ("error", "name", "message"),
    [
        (InputError("no such\nvoice"), "InputError", "no such voice"),
        (RuntimeError("my text"), "DefectError", "internal error: RuntimeError; see the log of the service"),
    ],
)
def test_an_error_ends_its_call_only(
    monkeypatch: pytest.MonkeyPatch, error: Exception, name: str, message: str
) -> None:
    def fails(*_: Any) -> Iterator[Step]:
        yield Chunk(b"a")
        raise error

    monkeypatch.setattr(SessionCache, "get", lambda *_: None)
    synthesis = Synthesis(SessionCache(), {"fails": fails, "works": lambda *_: iter([Chunk(b"a")])})
    order = {"priority": 0, "key": "", "id": "id-1"}
    failed, works = (
        answered(synthesis.synthesise, order | {"work": Work(kind).as_json()})[-1] for kind in ("fails", "works")
    )
    assert (failed.kind, failed.content["errors"][0], failed.content["message"]) == (ERROR, name, message)
    assert works.content["seconds"] == 0.0
