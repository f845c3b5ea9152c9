"""The side of the child: calls from standard input, answered by a table of handlers; it ends with its parent."""

import os
import queue
import signal
import sys
import threading
import traceback
from collections import defaultdict
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, BinaryIO, NoReturn

from lexicon.errors import Tts2faceError
from tts2face.processes.message import ERROR, EVENT, MORE, RESULT, Message, read_message
from tts2face.types import Progress

Handler = Callable[["Call"], Mapping[str, Any] | Message]


class Call:
    """One call as its handler sees it: the order, and the way back.

    Attributes
    ----------
    content, payload
        The order.
    """

    def __init__(self, message: Message, out: BinaryIO, inputs: "queue.SimpleQueue[Message]") -> None:
        self.name, self.content, self.payload = message.kind, message.content, message.payload
        self._id, self._out, self._inputs = message.id, out, inputs
        self._hidden: dict[str, str] = {}

    def event(self, content: Mapping[str, Any], payload: bytes = b"") -> None:
        """Tell the caller something before the result."""
        self.send(Message(EVENT, content, payload))

    def stage(self, name: str) -> Progress:
        """Progress callback of a stage, which sends ``stage``, ``done`` and ``of``; equal ones are sent once."""
        sent = [(0, 0)]

        def report(done: int, of: int) -> None:
            if (done, of) != sent[0]:
                sent[0] = (done, of)
                self.event({"stage": name, "done": done, "of": of})

        self.event({"stage": name, "done": 0, "of": 0})
        return report

    def more(self) -> Message:
        """The next further input, for which is waited."""
        return self._inputs.get()

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
        """Write a message of this call."""
        self._out.write(Message(message.kind, message.content, message.payload, self._id).encoded())
        self._out.flush()


def serve(handlers: Mapping[str, Handler], out: BinaryIO) -> NoReturn:
    """Answer calls, one after the other, until standard input ends, and this process with it.

    Errors of tts2face go back by their names; others end the process.

    Parameters
    ----------
    handlers
        By the names of the calls.
    out
        As of `claim_standard_output`.
    """
    calls: queue.SimpleQueue[Call] = queue.SimpleQueue()

    def receive() -> None:
        inputs: queue.SimpleQueue[Message] = queue.SimpleQueue()
        while (message := read_message(sys.stdin.buffer)) is not None:
            if message.kind == MORE:
                inputs.put(message)
            else:
                inputs = queue.SimpleQueue()
                calls.put(Call(message, out, inputs))

    exit_after(receive)
    try:
        while True:
            answer(calls.get(), handlers)
    except BaseException:  # noqa: BLE001 - whatever it is, it ends this process
        traceback.print_exc()
        sys.stderr.flush()
        os._exit(1)  # the thread that reads holds standard input


def answer(call: Call, handlers: Mapping[str, Handler]) -> None:
    """Answer one call by its handler: with its result or with its error."""
    try:
        found = handlers[call.name](call)
    except Tts2faceError as error:
        names = [one.__name__ for one in type(error).__mro__ if issubclass(one, Tts2faceError)]
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
