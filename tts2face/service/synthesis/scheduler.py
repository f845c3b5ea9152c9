"""Cooperative scheduling of tasks in one process: whoever is nearest to running dry goes next."""

import json
import logging
import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from lexicon.errors import Tts2faceError
from tts2face.service.logs import log_event
from tts2face.service.synthesis.messages import DEFECT, Event, Message, MessageKind, Wait
from tts2face.types import Chunk

Step = Chunk | Event | Wait  # a part of the result, or a wait
Send = Callable[[Message], None]


@dataclass(slots=True)
class Task:
    """A result that is made step by step."""

    number: int
    steps: Iterator[Step]
    priority: int
    begin: float
    seconds: float = 0.0  # of the clip made so far
    cpu_s: float = 0.0
    is_paused: bool = False
    wakes_at: float = 0.0  # seconds of the clock; infinite: only by input
    is_urgent: bool = False  # it runs before all others, as something is to be ended, until it answers
    request: str | None = None  # id of the request, for the log

    def lead(self, now: float) -> float:
        """Seconds by which the result is ahead of a listener who began at the request."""
        return self.seconds - (now - self.begin)


class Scheduler:
    """Runs tasks in steps of some hundredths of a second; a task of lower priority runs when no other can.

    Parameters
    ----------
    send
        Receives all messages of the tasks.
    clock
        Monotonic seconds.
    """

    def __init__(self, send: Send, clock: Callable[[], float] = time.monotonic) -> None:
        self._send, self._clock = send, clock
        self._tasks: dict[int, Task] = {}

    @property
    def n_tasks(self) -> int:
        """Number of unfinished tasks."""
        return len(self._tasks)

    def start(
        self, number: int, steps: Callable[[], Iterator[Step]], priority: int = 0, request: str | None = None
    ) -> None:
        """Add a task of the request with the given id; an error of `steps` becomes its message."""
        began = self._clock()
        try:
            made = steps()
        except Exception as error:  # noqa: BLE001 - reported to the client; other tasks go on
            self._send_error(number, error, request)
            return
        self._tasks[number] = Task(number, made, priority, began, cpu_s=self._clock() - began, request=request)

    def cancel(self, number: int) -> None:
        """Forget a task and release what it holds."""
        task = self._tasks.pop(number, None)
        if task is not None:
            _close(task)

    def pause(self, number: int, *, is_paused: bool) -> None:
        """Stop or continue a task whose reader is slower than its steps."""
        if number in self._tasks:
            self._tasks[number].is_paused = is_paused

    def wake(self, number: int, *, is_urgent: bool = False) -> None:
        """Continue a task that waited for input; an urgent one runs before all others until it answers (`Event`)."""
        if number in self._tasks:
            self._tasks[number].wakes_at = 0.0
            self._tasks[number].is_urgent |= is_urgent

    def seconds_to_wait(self) -> float | None:
        """Seconds until a task can run without input; None if none will."""
        wakes_at = min((task.wakes_at for task in self._tasks.values() if not task.is_paused), default=math.inf)
        return None if wakes_at == math.inf else max(0.0, wakes_at - self._clock())

    def run_step(self) -> bool:
        """Run one step of the task that needs it most; False if no task can run."""
        now = self._clock()
        ready = [task for task in self._tasks.values() if not task.is_paused and task.wakes_at <= now]
        if not ready:
            return False
        self._advance(min(ready, key=lambda task: (not task.is_urgent, task.priority, task.lead(now))))
        return True

    def _advance(self, task: Task) -> None:
        began = self._clock()
        try:
            step = next(task.steps)
        except StopIteration:
            task.cpu_s += self._clock() - began
            del self._tasks[task.number]
            self._send(_json_message(task.number, MessageKind.END, {
                "seconds": round(task.seconds, 4), "cpu_s": round(task.cpu_s, 4)
            }))  # fmt: skip
            return
        except Exception as error:  # noqa: BLE001 - reported to the client; other tasks go on
            del self._tasks[task.number]
            self._send_error(task.number, error, task.request)
            return
        task.cpu_s += self._clock() - began
        if isinstance(step, Wait):
            task.wakes_at = math.inf if step.seconds is None else self._clock() + step.seconds
            return
        task.seconds += step.seconds
        if isinstance(step, Event):
            task.is_urgent &= not step.is_answer
            self._send(_json_message(task.number, MessageKind.EVENT, step.content, step.seconds))
        elif step.content:
            self._send(Message(task.number, MessageKind.DATA, step.content, step.seconds))

    def _send_error(self, number: int, error: Exception, request: str | None) -> None:
        # A subclass counts as the kind of `lexicon.errors` that it extends.
        kind = next((one.__name__ for one in type(error).__mro__ if one.__module__ == Tts2faceError.__module__), DEFECT)
        message = str(error)
        if not isinstance(error, Tts2faceError):
            log_event("defect", level=logging.ERROR, error=error, id=request)
            kind, message = DEFECT, f"internal error: {type(error).__name__}; see the log of the service"
        self._send(_json_message(number, MessageKind.ERROR, {"kind": kind, "message": " ".join(message.split())}))


def _json_message(number: int, kind: MessageKind, content: dict[str, Any], seconds: float = 0.0) -> Message:
    return Message(number, kind, json.dumps(content, ensure_ascii=False, separators=(",", ":")).encode(), seconds)


def _close(task: Task) -> None:
    close = getattr(task.steps, "close", None)
    if close is not None:
        close()
