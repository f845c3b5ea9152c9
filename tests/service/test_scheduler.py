"""Tasks of one process take turns."""

import json
from collections.abc import Iterator

import pytest

from lexicon.errors import InputError
from tts2face.service.synthesis.messages import Event, Message, MessageKind, Wait
from tts2face.service.synthesis.scheduler import Scheduler, Step
from tts2face.types import Chunk


class Clock:
    """Seconds that pass only when steps let them."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def sent() -> list[Message]:
    return []


@pytest.fixture
def scheduler(clock: Clock, sent: list[Message]) -> Scheduler:
    return Scheduler(sent.append, clock)


def speech(clock: Clock, n_steps: int, *, seconds: float = 1.0, takes: float = 0.1) -> Iterator[Step]:
    for number in range(n_steps):
        clock.now += takes
        yield Chunk(bytes([number]), seconds)


def run(scheduler: Scheduler) -> None:
    while scheduler.run_step():
        pass


def test_the_result_of_a_task_is_sent_in_order(scheduler: Scheduler, sent: list[Message], clock: Clock) -> None:
    scheduler.start(7, lambda: speech(clock, 3))
    run(scheduler)
    assert [(one.task, one.kind, one.payload) for one in sent[:-1]] == [
        (7, MessageKind.DATA, bytes([number])) for number in range(3)
    ]
    assert sent[-1].kind == MessageKind.END
    assert json.loads(sent[-1].payload) == {"seconds": 3.0, "cpu_s": pytest.approx(0.3)}
    assert scheduler.n_tasks == 0


def test_a_new_task_begins_before_one_that_is_ahead_continues(
    scheduler: Scheduler, sent: list[Message], clock: Clock
) -> None:
    scheduler.start(1, lambda: speech(clock, 10))
    for _ in range(4):
        scheduler.run_step()
    scheduler.start(2, lambda: speech(clock, 10))
    scheduler.run_step()
    assert [one.task for one in sent] == [1, 1, 1, 1, 2]
    run(scheduler)
    order = [one.task for one in sent if one.kind == MessageKind.DATA]
    assert order[5:8] == [2, 2, 2]  # until both are equally far ahead of their listeners
    assert set(order[8:14]) == {1, 2}


def test_tasks_of_lower_priority_run_when_no_other_can(scheduler: Scheduler, sent: list[Message], clock: Clock) -> None:
    scheduler.start(1, lambda: speech(clock, 2), priority=1)
    scheduler.start(2, lambda: speech(clock, 2, seconds=100.0), priority=0)
    run(scheduler)
    assert [one.task for one in sent if one.kind == MessageKind.DATA] == [2, 2, 1, 1]


def test_a_paused_task_waits(scheduler: Scheduler, sent: list[Message], clock: Clock) -> None:
    scheduler.start(1, lambda: speech(clock, 2))
    scheduler.pause(1, is_paused=True)
    assert not scheduler.run_step()
    scheduler.pause(1, is_paused=False)
    run(scheduler)
    assert len(sent) == 3


def test_a_task_without_input_waits_until_it_is_woken(scheduler: Scheduler, sent: list[Message], clock: Clock) -> None:
    def listens() -> Iterator[Step]:
        yield Wait()
        yield Event({"heard": True}, 0.5)

    scheduler.start(1, listens)
    run(scheduler)
    assert sent == []
    scheduler.wake(1)
    run(scheduler)
    assert json.loads(sent[0].payload) == {"heard": True}


def test_an_urgent_task_runs_next(scheduler: Scheduler, sent: list[Message], clock: Clock) -> None:
    """Until it answers, even if it is ahead, waits for what it has interrupted, and first completes a piece."""

    def interrupted() -> Iterator[Step]:
        yield Chunk(b"", 100.0)
        yield Wait()
        yield Wait()
        yield Chunk(b"sound", 1.0)
        yield Event({"type": "cancelled"}, is_answer=True)
        yield Event({"type": "later"})

    scheduler.start(1, interrupted)
    for _ in range(2):
        scheduler.run_step()
    scheduler.start(2, lambda: speech(clock, 2))
    for _ in range(2):
        scheduler.wake(1, is_urgent=True)
        scheduler.run_step()
    run(scheduler)
    assert [one.task for one in sent if one.kind in {MessageKind.DATA, MessageKind.EVENT}] == [1, 1, 2, 2, 1]


def test_a_cancelled_task_releases_what_it_holds(scheduler: Scheduler, sent: list[Message], clock: Clock) -> None:
    released: list[bool] = []

    def holds() -> Iterator[Step]:
        try:
            yield from speech(clock, 9)
        finally:
            released.append(True)

    scheduler.start(1, holds)
    scheduler.run_step()
    scheduler.cancel(1)
    assert released == [True]
    assert not scheduler.run_step()
    assert len(sent) == 1


@pytest.mark.parametrize(
    ("error", "kind", "message"),
    [
        (InputError("no such\nvoice"), "InputError", "no such voice"),
        (RuntimeError("my text"), "InternalError", "internal error: RuntimeError; see the log of the service"),
    ],
)
def test_an_error_ends_its_task_only(
    scheduler: Scheduler, sent: list[Message], clock: Clock, error: Exception, kind: str, message: str
) -> None:
    def fails() -> Iterator[Step]:
        yield Chunk(b"a")
        raise error

    def refused() -> Iterator[Step]:
        raise error

    scheduler.start(1, fails)
    scheduler.start(2, refused)
    scheduler.start(3, lambda: speech(clock, 2))
    run(scheduler)
    errors = {one.task: json.loads(one.payload) for one in sent if one.kind == MessageKind.ERROR}
    assert errors == {number: {"kind": kind, "message": message} for number in (1, 2)}
    assert [one.kind for one in sent if one.task == 3] == [MessageKind.DATA, MessageKind.DATA, MessageKind.END]
