"""Turns of the calls of a process: one at a time computes, and others go on while it waits for something else.

All work of the service is done in such turns, a sentence or a few pictures at a time, and keys share them.
"""

import re
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, TypeVar

from lexicon.errors import InputError
from tts2face.processes.child import Call, StoppedError
from tts2face.serving.service.messages import CANCEL, Event, Line, Step, Wait
from tts2face.types import Chunk

Result = TypeVar("Result")

AHEAD_S = 1.0  # by which a result is ahead of its listener before those of other keys that are not go first
CREDIT_S = 1.0  # of computing that a key which has been idle is ahead of the others: a few sentences, or one movie
MAX_WORD_CHARACTERS = 200  # 300 digits are 70 s of speech, made in one step of 7 s, during which all others wait
_LONG_WORD = re.compile(rf"[!-~]{{{MAX_WORD_CHARACTERS + 1}}}|\d{{{MAX_WORD_CHARACTERS + 1}}}")
_CURRENT = threading.local()


class InterruptedTaskError(Exception):
    """The result for which a task waited is no longer needed; the task goes on."""


@dataclass(slots=True, eq=False)
class _Share:
    """Seconds that the calls of one key have computed; of a key that was idle, nearly as much as the others."""

    used: float = 0.0


@dataclass(slots=True, eq=False)
class _Task:
    """A call whose result is made step by step, in the thread that makes it.

    Parameters
    ----------
    share
        Of its key.
    dry_at
        Second of the clock at which a listener, who waits for what is not made yet, has heard all of the result.
    seconds
        Of the result made so far.
    """

    turns: "Turns"
    call: Call
    priority: int
    share: _Share
    dry_at: float
    seconds: float = 0.0
    cpu_s: float = 0.0

    @property
    def is_urgent(self) -> bool:
        """Whether something is to be ended by an input that the task has not read yet."""
        with self.call.changed:
            return any(message.content.get("type") == CANCEL for message in self.call.inputs)

    def order(self) -> tuple[bool, int, bool, float, bool, float]:
        """Place among the tasks that wait for a turn; the least one is first."""
        is_urgent = self.is_urgent
        is_ahead = self.dry_at > self.turns.now + AHEAD_S and not is_urgent
        priority = 0 if is_urgent else self.priority
        return not self.call.is_stopped, priority, is_ahead, self.share.used, not is_urgent, self.dry_at

    def charge(self, seconds: float) -> None:
        """Note what has been computed for it."""
        with self.call.changed:  # tasks of one share are charged by several threads
            self.cpu_s += seconds
            self.share.used += seconds

    def add(self, seconds: float, now: float) -> None:
        """Note that the result has become longer."""
        self.seconds += seconds
        if seconds:
            self.dry_at = max(self.dry_at, now) + seconds


class Turns:
    """Gives turns of some hundredths of a second to calls that run at once in the threads of one process.

    A stopped call goes first, to release what it holds; then by priority, a higher one when no other can run; then the
    call of the key for which least has been computed, unless its listener has enough to hear; of one key, one with an
    urgent input, then whichever runs dry first, or has been dry longest: a new one counts from its request. So a key
    waits for a turn of another one, however much that asks (decision 203), and of the calls of a key none waits longer
    than it takes all others to have a part made (decision 182). A paused call waits.

    Parameters
    ----------
    clock
        Monotonic seconds.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._waiting: list[_Task] = []
        self._holder: _Task | None = None
        self._taken_at = 0.0
        self._shares: dict[str, _Share] = {}
        self._used = 0.0  # by the key of a turn when it began, the most so far: each key that always works has as much

    @property
    def now(self) -> float:
        """Second of the clock."""
        return self._clock()

    def run(self, call: Call, make: Callable[[], Iterator[Step]], priority: int = 0, key: str = "") -> dict[str, float]:
        """Send the parts of a result; its seconds and those of the turns.

        Parameters
        ----------
        make
            Makes the steps, at the first turn.
        key
            Who shares turns with others.

        Raises
        ------
        StoppedError
            The caller has left.
        """
        with call.changed:
            share = self._shares.setdefault(key, _Share())
        task = _CURRENT.task = _Task(self, call, priority, share, self._clock())
        steps: Any = None
        try:
            self._take(task)
            steps = make()
            for step in steps:
                if isinstance(step, Wait):
                    self._wait(task, lambda: bool(call.inputs), step.seconds)
                else:
                    task.add(step.seconds, self._clock())
                    _send(task, step)
                    self._release(task)
                self._take(task)
        finally:
            # a generator frees what it holds at once, not when it is collected
            if hasattr(steps, "close"):
                steps.close()
            self._release(task)
            del _CURRENT.task
        return {"seconds": round(task.seconds, 4), "cpu_s": round(task.cpu_s, 4)}

    def wait_elsewhere(self, task: _Task, future: Future[Result], end: Callable[[], None]) -> Result:
        """As the function of this name, for a task."""
        future.add_done_callback(lambda _: _notify(task.call))
        self._wait(task, lambda: future.done() or task.is_urgent)
        # what runs cannot be cancelled, and is ended by its own means
        if not future.done() and not future.cancel():
            end()
        self.take_again(task)
        return future.result()

    def take_again(self, task: _Task) -> None:
        """Wait for another turn of a task."""
        self._release(task)
        self._take(task)
        if task.is_urgent:
            raise InterruptedTaskError

    def _wait(self, task: _Task, is_over: Callable[[], bool], seconds: float | None = None) -> None:
        """End the turn, and wait until it is over, `seconds` have passed, or the task is stopped."""
        self._release(task)
        with task.call.changed:
            task.call.changed.wait_for(lambda: task.call.is_stopped or is_over(), seconds)

    def _take(self, task: _Task) -> None:
        """Wait for the turn of a task; one that is stopped gets it with a `StoppedError`."""
        with task.call.changed:
            paused_at = self._clock() if task.call.is_paused else None
            self._waiting.append(task)
            task.share.used = max(task.share.used, self._used - CREDIT_S)
            task.call.changed.wait_for(lambda: self._is_next(task))
            self._waiting.remove(task)
            self._holder, self._taken_at = task, self._clock()
            self._used = max(self._used, task.share.used)
            if paused_at is not None:  # who does not read has enough to hear
                task.dry_at += self._taken_at - paused_at
        if task.call.is_stopped:
            raise StoppedError

    def _is_next(self, task: _Task) -> bool:
        if self._holder is not None:
            return False
        first = self._first()
        if first is not task and first is not None:  # who was woken is paused now, or another one has become urgent
            _notify(first.call)
        return first is task

    def _first(self) -> _Task | None:
        ready = [task for task in self._waiting if task.call.is_stopped or not task.call.is_paused]
        return min(ready, key=_Task.order, default=None)

    def _release(self, task: _Task) -> None:
        """End the turn of a task, if it has one."""
        if self._holder is task:
            task.charge(self._clock() - self._taken_at)
            with task.call.changed:
                self._holder = None
                if (first := self._first()) is not None:
                    _notify(first.call)


def _notify(call: Call) -> None:
    with call.changed:
        call.changed.notify_all()


def _send(task: _Task, step: Chunk | Event | Line) -> None:
    if isinstance(step, Event):
        task.call.event({"seconds": step.seconds, "event": step.content})
    elif isinstance(step, Line):
        task.call.event({"seconds": step.seconds, "is_json": True}, step.content)
    elif step.content:
        task.call.event({"seconds": step.seconds}, step.content)


class OneAtATime:
    """Runs computations of native code one after another, in the order of turns, while other tasks have theirs."""

    def __init__(self) -> None:
        self._thread = ThreadPoolExecutor(1, "native")
        self._waiting: list[tuple[_Task | None, Callable[[], Any], Future[Any]]] = []

    def __call__(self, compute: Callable[[], Result], end: Callable[[], None]) -> Result:
        """Result of `compute`, which `end` ends early; both are called from different threads."""
        future: Future[Result] = Future()
        self._waiting.append((getattr(_CURRENT, "task", None), compute, future))
        self._thread.submit(self._run_first)
        return wait_elsewhere(future, end)

    def _run_first(self) -> None:
        first = min(self._waiting[:], key=lambda place: (place[0] is not None, place[0] and place[0].order()))
        self._waiting.remove(first)
        task, compute, future = first
        if not future.set_running_or_notify_cancel():
            return
        began = time.monotonic()
        try:
            result = compute()
        except BaseException as error:  # noqa: BLE001 - whoever waits gets it
            future.set_exception(error)
        else:
            future.set_result(result)
        if task is not None:
            task.charge(time.monotonic() - began)


def lead() -> float:
    """Seconds that a listener can go on hearing or seeing what the present task has made; negative: has waited."""
    task: _Task = _CURRENT.task
    return task.dry_at - task.turns.now


def wait_elsewhere(future: Future[Result], end: Callable[[], None] = lambda: None) -> Result:
    """Result of what another thread or process does, during which other tasks have their turns.

    Parameters
    ----------
    end
        Ends it early, when it runs and the task is stopped or interrupted; nobody waits for its end.
    """
    task: _Task | None = getattr(_CURRENT, "task", None)
    return future.result() if task is None else task.turns.wait_elsewhere(task, future, end)


def give_turn() -> None:
    """Let others have their turns before the present task goes on; errors as `wait_elsewhere`."""
    task: _Task | None = getattr(_CURRENT, "task", None)
    if task is not None:
        task.turns.take_again(task)


def check_words(text: str) -> None:
    """Refuse words that would take a turn of seconds; scripts without spaces are not concerned."""
    if (found := _LONG_WORD.search(text)) is not None:
        raise InputError(
            f"the text has a word of more than {MAX_WORD_CHARACTERS} characters, {found[0][:20]}...; put spaces into it"
        )
