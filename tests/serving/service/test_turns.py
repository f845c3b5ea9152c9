"""Calls of one process take turns, and wait for other threads and processes meanwhile."""

import io
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from functools import partial
from typing import Any

import numpy as np
import pytest

from lexicon.errors import InputError
from tests.processes.answered import answered
from tests.running import eventually
from tts2face.processes.child import Call, StoppedError
from tts2face.processes.message import ERROR, GO, MORE, PAUSE, STOP, Message, read_message
from tts2face.serving.service.messages import Event, Step, Wait, Work
from tts2face.serving.service.scheduler import InterruptedTaskError, OneAtATime, Turns, wait_elsewhere
from tts2face.serving.service.synthesis import Synthesis
from tts2face.session.session_cache import SessionCache
from tts2face.sound.alignment import Aligner
from tts2face.sound.voice_pool import VoicePool, load_voice
from tts2face.types import Chunk

WAIT_S = 60.0


class Calls:
    """Calls of one process, and what they have sent; their seconds pass only when steps let them."""

    def __init__(self) -> None:
        self.now = 0.0
        self.turns, self.changed = Turns(lambda: self.now), threading.Condition()
        self.sent: list[Message] = []
        self.results: dict[int, Any] = {}  # measures or error
        self._calls: dict[int, Call] = {}
        self._threads: dict[int, threading.Thread] = {}

    def write(self, content: bytes) -> None:
        message = read_message(io.BytesIO(content))
        assert message is not None
        self.sent.append(message)

    def flush(self) -> None:
        pass

    def start(self, id: int, steps: Callable[[], Iterator[Step]], priority: int = 0, key: str = "") -> None:
        """Begin a call; returns when it has had a turn or waits for one."""
        call = self._calls[id] = Call(Message("make", id=id), self, self.changed)  # type: ignore[arg-type]

        def run() -> None:
            try:
                self.results[id] = self.turns.run(call, steps, priority, key)
            except (Exception, StoppedError) as error:  # noqa: BLE001
                self.results[id] = error

        before = self.sent[:]
        thread = self._threads[id] = threading.Thread(target=run, daemon=True)
        thread.start()
        eventually(lambda: id in self.results or self.n_waiting(id) or self.sent != before, WAIT_S)

    def n_waiting(self, id: int) -> int:
        return sum(one.call.id == id for one in self.turns._waiting)

    def control(self, id: int, kind: str, **content: Any) -> None:
        self._calls[id].control(Message(kind, content, id=id))

    def end(self, id: int) -> Any:
        """Result of a call."""
        self._threads[id].join(WAIT_S)
        return self.results[id]

    @property
    def order(self) -> list[int]:
        """Calls of all messages."""
        return [one.id for one in self.sent]

    def speech(self, n_steps: int, *, seconds: float = 1.0) -> Iterator[Step]:
        for number in range(n_steps):
            self.now += 0.1
            yield Chunk(bytes([number]), seconds)


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
