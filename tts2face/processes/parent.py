"""The side of the parent: children that are started by their first call, and again after they ended.

Parents with an event loop have `tts2face.processes.async_parent`, which takes longer to import.
"""

import io
import queue
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from typing import IO, Any

from lexicon.errors import BackendError, Tts2faceError
from tts2face.processes.message import (
    ERROR,
    EVENT,
    Message,
    read_message,
)
from tts2face.processes.program import Program

CHECK_S = 1.0  # between two checks of a caller who waits
# between tries to end a child that another thread is about to start
KILL_AGAIN_S = 0.05
END_S = 1.0  # until a process that has closed its output must have ended
MAX_SHOWN_CHARACTERS = 300  # of the standard error of a child that ended
TAIL_BYTES = 1 << 13  # of it that are read

OnEvent = Callable[[Message], object]


class ChildEndedError(BackendError):
    """The child ended, or was ended, before it answered; another try may succeed."""


def raised(message: Message) -> Tts2faceError:
    """The error of a message, by the first of its names that is known here."""
    known = {kind.__name__: kind for kind in _kinds(Tts2faceError)}
    kind = next((known[name] for name in message.content["errors"] if name in known), BackendError)
    return kind(message.content["message"])


def _kinds(kind: type[Tts2faceError]) -> Iterator[type[Tts2faceError]]:
    """Errors that are made from their message alone."""
    for narrower in kind.__subclasses__():
        if narrower.__init__ is Tts2faceError.__init__:
            yield narrower
        yield from _kinds(narrower)


def ended_error(kind: str, why: str) -> ChildEndedError:
    """Of a call of a kind whose child ended."""
    return ChildEndedError(f"the process that was to {kind} ended: {why}; check its memory and run again")


def child_command(program: Program) -> list[str]:
    """Command line of a child."""
    return [sys.executable, "-m", "tts2face.processes", program.written()]


def error_file(program: Program) -> IO[bytes] | None:
    """File of the standard error of a child; None: that of this process."""
    return None if program.has_log else tempfile.TemporaryFile()


def last_words(errors: IO[bytes] | None, code: int | None) -> str:
    """Why a child ended: the last line of its standard error."""
    if errors is None:
        return f"exit code {code}"
    errors.seek(max(errors.seek(0, io.SEEK_END) - TAIL_BYTES, 0))
    lines = errors.read().decode(errors="replace").strip().splitlines()
    errors.close()
    return (lines[-1] if lines else f"exit code {code}")[:MAX_SHOWN_CHARACTERS]


class Child:
    """A child for threads: one call at a time."""

    def __init__(self, program: Program) -> None:
        self._program = program
        self._child: subprocess.Popen[bytes] | None = None
        self._messages: queue.SimpleQueue[Message | None] = queue.SimpleQueue()
        self._errors: IO[bytes] | None = None
        self._reader: threading.Thread | None = None
        self._lock = threading.Lock()
        self._n_calls = 0
        self.is_closed = False

    @property
    def pid(self) -> int | None:
        """Number of the process; None while there is none."""
        return None if self._child is None else self._child.pid

    def call(
        self, kind: str, content: Mapping[str, Any], payload: bytes = b"", *, on_event: OnEvent | None = None,
        check: Callable[[], object] | None = None, timeout_s: float = float("inf"),
    ) -> Message:  # fmt: skip
        """Result of a call.

        Parameters
        ----------
        on_event
            Called with each event.
        check
            Called at least every `CHECK_S`; what it raises ends the child and the call.

        Raises
        ------
        Tts2faceError
            As the handler.
        ChildEndedError
            The child ended or took longer than `timeout_s`.
        BackendError
            This was closed.
        """
        with self._lock:
            if self.is_closed:
                raise BackendError("the child process was closed; run again")
            child, deadline = self._start(), time.monotonic() + timeout_s
            self._n_calls += 1
            is_answered = is_ended = False
            try:
                # a pipe may be closed between two statements
                with suppress(OSError, ValueError):  # it ended, which its messages tell
                    child.stdin.write(Message(kind, content, payload, self._n_calls).encoded())  # type: ignore[union-attr]
                    child.stdin.flush()  # type: ignore[union-attr]
                while time.monotonic() < deadline:
                    if check is not None:
                        check()
                    try:
                        message = self._messages.get(timeout=min(CHECK_S, deadline - time.monotonic()))
                    except queue.Empty:
                        continue
                    if message is None:
                        is_ended = True
                        break
                    if message.kind != EVENT:
                        is_answered = True
                        return answer_of(message)
                    if on_event is not None:
                        on_event(message)
            finally:
                why = "" if is_answered else self._end(is_killed=not is_ended)
            raise ended_error(kind, why)

    def kill(self) -> None:
        """End the process while another thread waits for it."""
        child = self._child
        if child is not None:
            child.kill()

    def close(self) -> None:
        """End the process at once and for good, also while another thread waits for it."""
        self.is_closed = True
        self.kill()
        while not self._lock.acquire(timeout=KILL_AGAIN_S):  # the other thread was about to start it
            self.kill()
        try:
            self._end(is_killed=True)
        finally:
            self._lock.release()

    def _start(self) -> "subprocess.Popen[bytes]":
        """The process that runs, or a new one."""
        if self._child is not None and self._child.poll() is None:
            return self._child
        self._end(is_killed=False)
        self._errors = error_file(self._program)
        self._child = subprocess.Popen(
            child_command(self._program), stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._errors,
            env=self._program.environment(),
        )  # fmt: skip
        self._messages = queue.SimpleQueue()
        self._reader = threading.Thread(target=_receive, args=(self._child.stdout, self._messages), daemon=True)
        self._reader.start()
        return self._child

    def _end(self, *, is_killed: bool) -> str:
        """End the process and wait for it; why it ended. One that has closed its output ends by itself."""
        child, self._child = self._child, None
        if child is None or self._reader is None:
            return "it was closed"
        if is_killed:
            child.kill()
        try:
            code = child.wait(None if is_killed else END_S)
        # a process that has closed its output may still hang
        except subprocess.TimeoutExpired:
            child.kill()
            code = child.wait()
        self._reader.join()
        for stream in (child.stdin, child.stdout):
            if stream is not None:
                with suppress(OSError):
                    stream.close()
        return last_words(self._errors, code)


def _receive(file: IO[bytes], messages: "queue.SimpleQueue[Message | None]") -> None:
    """Pass messages on; None at their end."""
    with suppress(OSError, ValueError):
        while (message := read_message(file)) is not None:  # type: ignore[arg-type]
            messages.put(message)
    messages.put(None)


def answer_of(message: Message) -> Message:
    """A message; raises the error that it holds."""
    if message.kind == ERROR:
        raise raised(message)
    return message
