"""The side of a parent with an event loop: children that work on several calls at once."""

import asyncio
import time
from collections.abc import AsyncGenerator, AsyncIterator, Callable, Mapping
from contextlib import aclosing, asynccontextmanager, suppress
from dataclasses import dataclass, field
from typing import IO, Any

from tts2face.processes.message import EVENT, GO, MAX_LINE_BYTES, MORE, PAUSE, STOP, Message, message_of, parse_head
from tts2face.processes.parent import END_S, OnEvent, answer_of, child_command, ended_error, error_file, last_words
from tts2face.processes.program import Program

PAUSE_BYTES = 1 << 20  # of a call that its caller has not read yet, beyond which it is paused; some seconds of a movie
# a quarter of `PAUSE_BYTES`: a call is not paused and continued with each message
GO_BYTES = 256 << 10

Inputs = AsyncIterator[tuple[Mapping[str, Any], bytes]]  # of a call that goes on: contents and payloads


async def receive_message(stream: asyncio.StreamReader) -> Message | None:
    """The next message of a pipe; None where it ends, or sends what is none."""
    try:
        head = parse_head(await stream.readline())
        return None if head is None else message_of(head, await stream.readexactly(head["n_bytes"]))
    # the process is damaged or gone: both end it
    except (ValueError, asyncio.IncompleteReadError, ConnectionError):  # a line that is too long, or half a message
        return None


@dataclass(slots=True, eq=False)
class _Answers:
    """Messages of a call that its caller has not read yet; None at the end of the child."""

    id: int
    on_paused: Callable[[bool], None]
    messages: asyncio.Queue[Message | None] = field(default_factory=asyncio.Queue)
    n_bytes: int = 0
    is_paused: bool = False
    stopped_at: float | None = None  # second of the clock at which its caller left


class _Running:
    """A process, and the calls that it works on."""

    def __init__(
        self, process: asyncio.subprocess.Process, errors: IO[bytes] | None, on_released: Callable[[float], None]
    ) -> None:
        self.process = process
        self._errors = errors
        self._on_released = on_released
        self.why = ""  # it ended
        self._calls: dict[int, _Answers] = {}
        self.reading = asyncio.create_task(self._read())

    def begin(self, id: int, on_paused: Callable[[bool], None]) -> _Answers:
        """Answers of a new call."""
        self._calls[id] = _Answers(id, on_paused)
        return self._calls[id]

    def write(self, message: Message) -> None:
        """Write a message as soon as the process reads it; nothing if it ended, which its messages tell."""
        if self.process.returncode is None and self.process.stdin is not None:
            self.process.stdin.write(message.encoded())

    async def send(self, message: Message) -> None:
        """Write a message, and wait until the process has read most of what was written."""
        self.write(message)
        # it has ended, which its messages say
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
            self._pause(call, is_paused=False)
        return message

    def _pause(self, call: _Answers, *, is_paused: bool) -> None:
        call.is_paused = is_paused
        self.write(Message(PAUSE if is_paused else GO, id=call.id))
        call.on_paused(is_paused)

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
        # it has ended by itself
        with suppress(ProcessLookupError):
            self.process.kill()

    async def _read(self) -> None:
        """Distribute messages until the process ends; a loop that ends first takes the process with it."""
        try:
            await self._distribute()
        except asyncio.CancelledError:
            self._kill()
            self.why = last_words(self._errors, await self.process.wait())
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
        self.why = last_words(self._errors, await self.process.wait())
        for call in self._calls.values():
            call.messages.put_nowait(None)

    def _add(self, call: _Answers, message: Message) -> None:
        if message.kind != EVENT:
            del self._calls[call.id]
        if call.stopped_at is None:
            call.messages.put_nowait(message)
            call.n_bytes += len(message.payload)
            if call.n_bytes > PAUSE_BYTES and not call.is_paused:
                self._pause(call, is_paused=True)
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
        self, kind: str, content: Mapping[str, Any], payload: bytes = b"", *, inputs: Inputs | None = None,
        on_paused: Callable[[bool], None] = lambda _: None,
    ) -> AsyncGenerator[Message]:  # fmt: skip
        """Messages of a call up to its result; errors, and leaving it, as `call`.

        Parameters
        ----------
        inputs
            What the handler gets by `tts2face.processes.child.Call.more`.
        on_paused
            Called when the call is paused, since much of its answer has not been read, and when it goes on.
        """
        async with self._places:
            running = await self._start()
            self._n_calls += 1
            call = running.begin(self._n_calls, on_paused)
            forwarding, is_answered = None, False
            try:
                await running.send(Message(kind, content, payload, call.id))
                if inputs is not None:
                    forwarding = asyncio.create_task(running.forward(inputs, call.id))
                while (message := await running.next(call)) is not None:
                    is_answered = message.kind != EVENT
                    yield answer_of(message)
                    if is_answered:
                        return
                raise ended_error(kind, running.why)
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
                errors = error_file(self._program)
                try:
                    process = await asyncio.create_subprocess_exec(
                        *child_command(self._program), stdin=asyncio.subprocess.PIPE, stdout=asyncio.subprocess.PIPE,
                        stderr=errors, env=self._program.environment(), limit=MAX_LINE_BYTES,
                    )  # fmt: skip
                except BaseException:  # such as a caller that leaves while the process starts
                    if errors is not None:
                        errors.close()
                    raise
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
