"""The side of the child: calls from standard input, answered by a table of handlers; it ends with its parent."""

import os
import queue
import signal
import sys
import threading
import traceback
from collections import defaultdict, deque
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, NoReturn

from lexicon.errors import Tts2faceError
from tts2face.processes.message import CONTROLS, ERROR, EVENT, MORE, PAUSE, RESULT, STOP, Message, read_message

if TYPE_CHECKING:  # a child that needs no types of sound and motion starts without them
    from tts2face.types import Progress

Handler = Callable[["Call"], Mapping[str, Any] | Message]


class StoppedError(BaseException):
    """The caller has left: the handler releases what it holds, and nobody waits for its result."""


class Call:
    """One call as its handler sees it: the order, and the way back.

    Parameters
    ----------
    changed
        Notified when an input arrives, and when the call is paused, continued or stopped; all calls of a process share
        its lock.

    Attributes
    ----------
    content, payload
        The order.
    inputs
        Further inputs that nobody has read yet.
    is_paused
        The caller has not read what was sent; a handler may wait.
    is_stopped
        The caller has left.
    """

    def __init__(self, message: Message, out: BinaryIO, changed: threading.Condition) -> None:
        self.name = message.kind
        self.content = message.content
        self.payload = message.payload
        self.id = message.id
        self.changed, self.inputs = changed, deque[Message]()
        self.is_paused = self.is_stopped = False
        self._out = out
        self._hidden: dict[str, str] = {}

    def control(self, message: Message) -> None:
        """Note one of `CONTROLS`."""
        with self.changed:
            if message.kind == MORE:
                self.inputs.append(message)
            elif message.kind == STOP:
                self.is_stopped = True
            else:
                self.is_paused = message.kind == PAUSE
            self.changed.notify_all()

    def event(self, content: Mapping[str, Any], payload: bytes = b"") -> None:
        """Tell the caller something before the result."""
        self.send(Message(EVENT, content, payload))

    def stage(self, name: str) -> "Progress":
        """Progress callback of a stage, which sends ``stage``, ``done`` and ``of``; equal ones are sent once."""
        sent = [(0, 0)]

        def report(done: int, of: int) -> None:
            # equal reports would wake the parent for nothing
            if (done, of) != sent[0]:
                sent[0] = (done, of)
                self.event({"stage": name, "done": done, "of": of})

        self.event({"stage": name, "done": 0, "of": 0})
        return report

    def more(self) -> Message:
        """The next further input, for which is waited.

        Raises
        ------
        StoppedError
            The caller has left.
        """
        with self.changed:
            self.changed.wait_for(lambda: self.inputs or self.is_stopped)
            if self.is_stopped:
                raise StoppedError
            return self.inputs.popleft()

    def hide(self, path: str | Path, name: str = "") -> None:
        """Show a name in messages in place of a path; without one, paths below it are shown from there."""
        self._hidden[str(path) if name else f"{path}/"] = name

    def shown(self, error: Tts2faceError) -> str:
        """Message of an error in one line."""
        message = str(error)
        for path, name in self._hidden.items():
            message = message.replace(path, name)
        return " ".join(message.split())

    def send(self, message: Message) -> None:
        """Write a message of this call, in one piece: calls of other threads write to the same file."""
        self._out.write(Message(message.kind, message.content, message.payload, self.id).encoded())
        self._out.flush()


def serve(handlers: Mapping[str, Handler], out: BinaryIO, at_once: int = 1) -> NoReturn:
    """Answer calls until standard input ends, and this process with it.

    Errors of tts2face go back by their names; others end the process.

    Parameters
    ----------
    handlers
        By the names of the calls.
    out
        As of `claim_standard_output`.
    at_once
        1: one call after the other, in this thread; more: each in a thread of its own.
    """
    waiting: queue.SimpleQueue[Call] = queue.SimpleQueue()
    live: dict[int, Call] = {}
    lock = threading.RLock()

    def receive() -> None:
        while (message := read_message(sys.stdin.buffer)) is not None:
            if message.kind not in CONTROLS:
                live[message.id] = Call(message, out, threading.Condition(lock))
                waiting.put(live[message.id])
            elif (call := live.get(message.id)) is not None:
                call.control(message)

    def work(call: Call) -> None:
        with _ending_with_errors():
            answer(call, handlers)
        del live[call.id]

    exit_after(receive)
    while True:
        call = waiting.get()
        if at_once == 1:
            work(call)
        else:
            threading.Thread(target=work, args=(call,), name=call.name, daemon=True).start()


@contextmanager
def _ending_with_errors() -> Iterator[None]:
    """End this process with any error of a ``with`` block."""
    try:
        yield
    except BaseException:  # noqa: BLE001 - whatever it is
        traceback.print_exc()
        # `os._exit` writes no buffer
        sys.stderr.flush()
        os._exit(1)  # the thread that reads holds standard input


def answer(call: Call, handlers: Mapping[str, Handler]) -> None:
    """Answer one call by its handler: with its result or with its error; that of a stopped call has no name."""
    try:
        found = handlers[call.name](call)
    except StoppedError:
        call.send(Message(ERROR, {"errors": [], "message": "the call was stopped"}))
    except Tts2faceError as error:
        names = [kind.__name__ for kind in type(error).__mro__ if issubclass(kind, Tts2faceError)]
        call.send(Message(ERROR, {"errors": names, "message": call.shown(error)}))
    else:
        call.send(found if isinstance(found, Message) else Message(RESULT, found))


def refusing(error: Tts2faceError) -> Mapping[str, Handler]:
    """Handlers of any name that raise an error."""

    def refuse(_: Call) -> NoReturn:
        raise error

    return defaultdict(lambda: refuse)


def bind_to_core(core: int | None) -> None:
    """Bind this process to a core, where the system can; None: to none."""
    if core is not None and hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {core})


def claim_standard_output() -> BinaryIO:
    """Standard output for answers alone; whatever a library prints goes to standard error from now on."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    return answers


def exit_after(wait: Callable[[], object]) -> None:
    """Exit this process as soon as `wait`, which runs in a background thread, returns or raises.

    Ctrl-C, which the terminal sends to the parent, too, is left to the parent.

    Parameters
    ----------
    wait
        Blocking read from a pipe whose other end only the parent holds; it returns when the parent closes the pipe or
        terminates.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_exit_after, args=(wait,), name="exit_after", daemon=True).start()


def _exit_after(wait: Callable[[], object]) -> None:
    try:
        wait()
    finally:
        os._exit(1)  # no clean-up: the parent that would receive the results no longer exists
