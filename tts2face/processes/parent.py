"""The side of the parent: children that are started by their first call, and again after they ended."""

import asyncio
import queue
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import AsyncGenerator, AsyncIterator, Callable, Iterator, Mapping
from contextlib import aclosing, asynccontextmanager, suppress
from typing import IO, Any

from lexicon.errors import BackendError, Tts2faceError
from tts2face.processes.message import (
    ERROR,
    EVENT,
    MAX_LINE_BYTES,
    MORE,
    Message,
    read_message,
    receive_message,
)
from tts2face.processes.program import Program

LOOK_S = 1.0  # between two looks of a caller who waits
KILL_AGAIN_S = 0.05
END_S = 1.0  # until a process that has closed its output must have ended
MAX_SHOWN_CHARACTERS = 300  # of the standard error of a child that ended

OnEvent = Callable[[Message], object]
Inputs = AsyncIterator[tuple[Mapping[str, Any], bytes]]  # of a call that goes on: contents and payloads


class ChildEndedError(BackendError):
    """The child ended, or was ended, before it answered; another try may succeed."""


def raised(message: Message) -> Tts2faceError:
    """The error of a message, by the first of its names that is known here."""
    known = {one.__name__: one for one in _kinds(Tts2faceError)}
    kind = next((known[name] for name in message.content["errors"] if name in known), BackendError)
    return kind(message.content["message"])


def _kinds(kind: type[Tts2faceError]) -> Iterator[type[Tts2faceError]]:
    """Errors that are made from their message alone."""
    for one in kind.__subclasses__():
        if one.__init__ is Tts2faceError.__init__:
            yield one
        yield from _kinds(one)


def _ended(kind: str, why: str) -> ChildEndedError:
    return ChildEndedError(f"the process that was to {kind} ended: {why}; check its memory and run again")


def _command(program: Program) -> list[str]:
    return [sys.executable, "-m", "tts2face.processes", program.written()]


def _last_words(errors: IO[bytes], code: int | None) -> str:
    """Why a child ended: the last line of its standard error."""
    errors.seek(0)
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
        self.is_closed = False

    @property
    def pid(self) -> int | None:
        """Number of the process; None while there is none."""
        return None if self._child is None else self._child.pid

    def call(
        self, kind: str, content: Mapping[str, Any], payload: bytes = b"", *, on_event: OnEvent | None = None,
        look: Callable[[], object] | None = None, timeout_s: float = float("inf"),
    ) -> Message:  # fmt: skip
        """Result of a call.

        Parameters
        ----------
        on_event
            Called with each event.
        look
            Called at least every `LOOK_S`; what it raises ends the child and the call.

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
            child, deadline = self._child or self._start(), time.monotonic() + timeout_s
            is_answered = is_ended = False
            try:
                with suppress(OSError, ValueError):  # it ended, which its messages tell
                    child.stdin.write(Message(kind, content, payload).encoded())  # type: ignore[union-attr]
                    child.stdin.flush()  # type: ignore[union-attr]
                while time.monotonic() < deadline:
                    if look is not None:
                        look()
                    try:
                        message = self._messages.get(timeout=min(LOOK_S, deadline - time.monotonic()))
                    except queue.Empty:
                        continue
                    if message is None:
                        is_ended = True
                        break
                    if message.kind != EVENT:
                        is_answered = True
                        return _answer(message)
                    if on_event is not None:
                        on_event(message)
            finally:
                why = "" if is_answered else self._end(is_killed=not is_ended)
            raise _ended(kind, why)

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
        self._errors = tempfile.TemporaryFile()  # noqa: SIM115 - as long as the child
        self._child = subprocess.Popen(
            _command(self._program), stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._errors,
            env=self._program.environment(),
        )  # fmt: skip
        self._messages = queue.SimpleQueue()
        self._reader = threading.Thread(target=_receive, args=(self._child.stdout, self._messages), daemon=True)
        self._reader.start()
        return self._child

    def _end(self, *, is_killed: bool) -> str:
        """End the process and wait for it; why it ended. One that has closed its output ends by itself."""
        child, self._child = self._child, None
        if child is None or self._reader is None or self._errors is None:
            return "it was closed"
        if is_killed:
            child.kill()
        try:
            code = child.wait(None if is_killed else END_S)
        except subprocess.TimeoutExpired:
            child.kill()
            code = child.wait()
        self._reader.join()
        for stream in (child.stdin, child.stdout):
            if stream is not None:
                with suppress(OSError):
                    stream.close()
        return _last_words(self._errors, code)


def _receive(file: IO[bytes], messages: "queue.SimpleQueue[Message | None]") -> None:
    """Pass messages on; None at their end."""
    with suppress(OSError, ValueError):
        while (message := read_message(file)) is not None:  # type: ignore[arg-type]
            messages.put(message)
    messages.put(None)


def _answer(message: Message) -> Message:
    if message.kind == ERROR:
        raise raised(message)
    return message


class AsyncChild:
    """A child for asyncio: one call at a time."""

    def __init__(self, program: Program) -> None:
        self._program = program
        self._child: asyncio.subprocess.Process | None = None
        self._errors: IO[bytes] | None = None
        self._lock = asyncio.Lock()

    async def call(
        self, kind: str, content: Mapping[str, Any], payload: bytes = b"", *, on_event: OnEvent | None = None,
        timeout_s: float | None = None,
    ) -> Message:  # fmt: skip
        """Result of a call; leaving it ends the child.

        Raises
        ------
        Tts2faceError
            As the handler.
        ChildEndedError
            The child ended.
        TimeoutError
            It took longer than `timeout_s`.
        """
        async with asyncio.timeout(timeout_s):
            async with aclosing(self.stream(kind, content, payload)) as messages:
                async for message in messages:
                    if message.kind != EVENT:
                        return message
                    if on_event is not None:
                        on_event(message)
        raise AssertionError("a stream ends with its result")

    async def stream(
        self, kind: str, content: Mapping[str, Any], payload: bytes = b"", *, inputs: Inputs | None = None
    ) -> AsyncGenerator[Message]:
        """Messages of a call up to its result; errors as `call`.

        Parameters
        ----------
        inputs
            What the handler gets by `tts2face.processes.child.Call.more`.
        """
        async with self._lock:
            child = self._child if self._child is not None and self._child.returncode is None else await self._start()
            assert child.stdout is not None
            forwarding, is_answered = None, False
            try:
                await _send(child, Message(kind, content, payload))
                if inputs is not None:
                    forwarding = asyncio.create_task(_forward(child, inputs))
                while (message := await receive_message(child.stdout)) is not None:
                    is_answered = message.kind != EVENT
                    yield _answer(message)
                    if is_answered:
                        return
                with suppress(TimeoutError):
                    await asyncio.wait_for(child.wait(), END_S)
            finally:
                if forwarding is not None:
                    forwarding.cancel()
                    await asyncio.gather(forwarding, return_exceptions=True)
                why = "" if is_answered else await self._end()
            raise _ended(kind, why)

    async def close(self) -> None:
        """End the process at once; the next call starts another one."""
        await self._end()

    async def close_when_idle(self) -> None:
        """End the process after the calls that wait."""
        async with self._lock:
            await self._end()

    async def _start(self) -> asyncio.subprocess.Process:
        await self._end()
        self._errors = tempfile.TemporaryFile()  # noqa: SIM115 - as long as the child
        self._child = await asyncio.create_subprocess_exec(
            *_command(self._program), stdin=asyncio.subprocess.PIPE, stdout=asyncio.subprocess.PIPE,
            stderr=self._errors, env=self._program.environment(), limit=MAX_LINE_BYTES,
        )  # fmt: skip
        return self._child

    async def _end(self) -> str:
        child, self._child, errors, self._errors = self._child, None, self._errors, None
        if child is None or errors is None:
            return "it was closed"
        if child.returncode is None:
            with suppress(ProcessLookupError):
                child.kill()
        return _last_words(errors, await child.wait())


async def _send(child: asyncio.subprocess.Process, message: Message) -> None:
    assert child.stdin is not None
    with suppress(ConnectionError):  # it ended, which its messages tell
        child.stdin.write(message.encoded())
        await child.stdin.drain()


async def _forward(child: asyncio.subprocess.Process, inputs: Inputs) -> None:
    async for content, payload in inputs:
        await _send(child, Message(MORE, content, payload))


@asynccontextmanager
async def started(program: Program) -> AsyncIterator[AsyncChild]:
    """A child that is ended when the context is left."""
    child = AsyncChild(program)
    try:
        yield child
    finally:
        await child.close()
