"""The side of the parent: children that are started by their first call, and again after they ended."""

import asyncio
import io
import queue
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import AsyncGenerator, AsyncIterator, Callable, Iterator, Mapping
from contextlib import aclosing, asynccontextmanager, suppress
from dataclasses import dataclass, field
from typing import IO, Any

from lexicon.errors import BackendError, Tts2faceError
from tts2face.processes.message import (
    ERROR,
    EVENT,
    GO,
    MAX_LINE_BYTES,
    MORE,
    PAUSE,
    STOP,
    Message,
    read_message,
    receive_message,
)
from tts2face.processes.program import Program

LOOK_S = 1.0  # between two looks of a caller who waits
KILL_AGAIN_S = 0.05
END_S = 1.0  # until a process that has closed its output must have ended
MAX_SHOWN_CHARACTERS = 300  # of the standard error of a child that ended
TAIL_BYTES = 1 << 13  # of it that are read
PAUSE_BYTES = 8 << 20  # of a call that its caller has not read yet, beyond which it is paused
GO_BYTES = 2 << 20

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


def _errors(program: Program) -> IO[bytes] | None:
    """File of the standard error of a child; None: that of this process."""
    return None if program.has_log else tempfile.TemporaryFile()


def _last_words(errors: IO[bytes] | None, code: int | None) -> str:
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
            child, deadline = self._start(), time.monotonic() + timeout_s
            self._n_calls += 1
            is_answered = is_ended = False
            try:
                with suppress(OSError, ValueError):  # it ended, which its messages tell
                    child.stdin.write(Message(kind, content, payload, self._n_calls).encoded())  # type: ignore[union-attr]
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
        """The process that runs, or a new one."""
        if self._child is not None and self._child.poll() is None:
            return self._child
        self._end(is_killed=False)
        self._errors = _errors(self._program)
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
        if child is None or self._reader is None:
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


@dataclass(slots=True, eq=False)
class _Answers:
    """What came of a call and its caller has not read yet; None at the end of the child."""

    id: int
    messages: asyncio.Queue[Message | None] = field(default_factory=asyncio.Queue)
    n_bytes: int = 0
    is_paused: bool = False
    stopped_at: float | None = None  # second of the clock at which its caller left


class _Running:
    """A process, and the calls that it works on."""

    def __init__(
        self, process: asyncio.subprocess.Process, errors: IO[bytes] | None, on_released: Callable[[float], None]
    ) -> None:
        self.process, self._errors, self._on_released = process, errors, on_released
        self.why = ""  # it ended
        self._calls: dict[int, _Answers] = {}
        self.reading = asyncio.create_task(self._read())

    def begin(self, id: int) -> _Answers:
        """Answers of a new call."""
        self._calls[id] = _Answers(id)
        return self._calls[id]

    def write(self, message: Message) -> None:
        """Write a message as soon as the process reads it; nothing if it ended, which its messages tell."""
        if self.process.returncode is None and self.process.stdin is not None:
            self.process.stdin.write(message.encoded())

    async def send(self, message: Message) -> None:
        """Write a message, and wait until the process has read most of what was written."""
        self.write(message)
        with suppress(ConnectionError):
            await self.process.stdin.drain()  # type: ignore[union-attr]

    async def forward(self, inputs: Inputs, id: int) -> None:
        """Send the inputs of a call."""
        async for content, payload in inputs:
            await self.send(Message(MORE, content, payload, id))

    async def next(self, call: _Answers) -> Message | None:
        """Next message of a call; None if the process ended."""
        message = await call.messages.get()
        call.n_bytes -= 0 if message is None else len(message.payload)
        if call.is_paused and call.n_bytes < GO_BYTES:
            call.is_paused = False
            self.write(Message(GO, id=call.id))
        return message

    def stop(self, call: _Answers) -> None:
        """Stop a call that nobody reads any more."""
        if call.id in self._calls:
            call.stopped_at = time.monotonic()
            self.write(Message(STOP, id=call.id))

    async def end(self) -> None:
        """End the process at once."""
        if not self.reading.done():
            self._kill()
        await asyncio.wait({self.reading})

    def _kill(self) -> None:
        with suppress(ProcessLookupError):
            self.process.kill()

    async def _read(self) -> None:
        """Distribute messages until the process ends; a loop that ends first takes the process with it."""
        try:
            await self._distribute()
        except asyncio.CancelledError:
            self._kill()
            self.why = _last_words(self._errors, await self.process.wait())
            raise

    async def _distribute(self) -> None:
        assert self.process.stdout is not None
        assert self.process.stdin is not None
        while (message := await receive_message(self.process.stdout)) is not None:
            call = self._calls.get(message.id)
            if call is not None:
                self._add(call, message)
        self.process.stdin.close()
        try:  # killing one that has just ended would take its exit status from asyncio, which warns then
            await asyncio.wait_for(self.process.wait(), END_S)
        except TimeoutError:
            self._kill()
        self.why = _last_words(self._errors, await self.process.wait())
        for call in self._calls.values():
            call.messages.put_nowait(None)

    def _add(self, call: _Answers, message: Message) -> None:
        if message.kind != EVENT:
            del self._calls[call.id]
        if call.stopped_at is None:
            call.messages.put_nowait(message)
            call.n_bytes += len(message.payload)
            if call.n_bytes > PAUSE_BYTES and not call.is_paused:
                call.is_paused = True
                self.write(Message(PAUSE, id=call.id))
        elif message.kind != EVENT:
            self._on_released(time.monotonic() - call.stopped_at)


class AsyncChild:
    """A child for asyncio: as many calls at once as its program says.

    Parameters
    ----------
    on_released
        Called, when a call that its caller left has released what it held, with the seconds that took; of programs
        with several calls at once.
    """

    def __init__(self, program: Program, on_released: Callable[[float], None] = lambda _: None) -> None:
        self._program, self._on_released = program, on_released
        self._places = asyncio.Semaphore(program.at_once)
        self._starting = asyncio.Lock()
        self._running: _Running | None = None
        self._n_calls = 0

    @property
    def pid(self) -> int | None:
        """Number of the process; None while there is none."""
        return None if self._running is None or self._running.reading.done() else self._running.process.pid

    async def call(
        self, kind: str, content: Mapping[str, Any], payload: bytes = b"", *, on_event: OnEvent | None = None,
        timeout_s: float | None = None,
    ) -> Message:  # fmt: skip
        """Result of a call; leaving it ends the call, and a child of one call at a time.

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
        """Messages of a call up to its result; errors, and leaving it, as `call`.

        Parameters
        ----------
        inputs
            What the handler gets by `tts2face.processes.child.Call.more`.
        """
        async with self._places:
            running = await self._start()
            self._n_calls += 1
            call = running.begin(self._n_calls)
            forwarding, is_answered = None, False
            try:
                await running.send(Message(kind, content, payload, call.id))
                if inputs is not None:
                    forwarding = asyncio.create_task(running.forward(inputs, call.id))
                while (message := await running.next(call)) is not None:
                    is_answered = message.kind != EVENT
                    yield _answer(message)
                    if is_answered:
                        return
                raise _ended(kind, running.why)
            finally:
                if forwarding is not None:
                    forwarding.cancel()
                if not is_answered and self._program.at_once > 1:
                    running.stop(call)
                elif not is_answered:
                    await running.end()
                if forwarding is not None:
                    await asyncio.gather(forwarding, return_exceptions=True)

    async def close(self) -> None:
        """End the process at once; the next call starts another one."""
        async with self._starting:
            if self._running is not None:
                await self._running.end()

    async def close_when_idle(self) -> None:
        """End the process after the calls that wait."""
        async with self._places:
            await self.close()

    async def _start(self) -> _Running:
        """The process that runs, or a new one."""
        async with self._starting:
            if self._running is None or self._running.reading.done():
                errors = _errors(self._program)
                process = await asyncio.create_subprocess_exec(
                    *_command(self._program), stdin=asyncio.subprocess.PIPE, stdout=asyncio.subprocess.PIPE,
                    stderr=errors, env=self._program.environment(), limit=MAX_LINE_BYTES,
                )  # fmt: skip
                self._running = _Running(process, errors, self._on_released)
            return self._running


@asynccontextmanager
async def started(program: Program) -> AsyncIterator[AsyncChild]:
    """A child that is ended when the context is left."""
    child = AsyncChild(program)
    try:
        yield child
    finally:
        await child.close()


async def call_once(
    program: Program, kind: str, content: Mapping[str, Any], *, on_event: OnEvent | None = None,
    timeout_s: float | None = None,
) -> Mapping[str, Any]:  # fmt: skip
    """Content of the result of a call of a child that works on this call only; errors as `AsyncChild.call`."""
    async with started(program) as child:
        return (await child.call(kind, content, on_event=on_event, timeout_s=timeout_s)).content
