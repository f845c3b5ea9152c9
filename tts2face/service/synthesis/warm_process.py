"""The server's side of one synthesis process."""

import asyncio
import json
import sys
import time
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

from lexicon.errors import BackendError, DataError, InputError, Tts2faceError
from tts2face.processes.limits import child_environment
from tts2face.service.logs import REQUEST_ID, log_event
from tts2face.service.synthesis.messages import DEFECT, HEADER, MAX_PAYLOAD_BYTES, Message, MessageKind
from tts2face.service.synthesis.work import Work

PAUSE_BYTES = 8 << 20  # of a result that nobody has read yet, beyond which its task is paused
RESUME_BYTES = 2 << 20
END_S = 1.0  # until a process that has closed its output must have ended


class ProcessEndedError(BackendError):
    """The synthesis process ended; the request may be repeated."""


class DefectError(BackendError):
    """A defect of the synthesis; the log has its traceback."""


# Errors of a synthesis process.
KINDS: dict[str, type[Tts2faceError]] = {
    "InputError": InputError, "DataError": DataError, "BackendError": BackendError, DEFECT: DefectError,
}  # fmt: skip


@dataclass(slots=True)
class Result:
    """What a task has sent and nobody has read yet."""

    messages: asyncio.Queue[Message | None] = field(default_factory=asyncio.Queue)
    n_bytes: int = 0
    is_paused: bool = False


class WarmProcess:
    """A synthesis process that is started again when it ends.

    Parameters
    ----------
    settings
        As for `tts2face.service.synthesis.synthesis_process`.
    on_ready
        Called whenever the process becomes ready or ends.
    """

    def __init__(self, settings: Mapping[str, Any], on_change: Callable[[], None]) -> None:
        self._settings, self._on_change = settings, on_change
        self._child: asyncio.subprocess.Process | None = None
        self._results: dict[int, Result] = {}
        self._number = 0
        self.is_ready = False
        self.is_closed = False
        self.on_cancelled: Callable[[float], None] = _ignore  # called with the seconds until a task was released
        self.load = 0.0  # sum of the costs of its tasks

    @property
    def pid(self) -> int | None:
        """Number of the process."""
        return None if self._child is None else self._child.pid

    async def run(self) -> None:
        """Start the process, distribute its messages, and start it again whenever it ends, until `close`."""
        while not self.is_closed:
            self._child = await asyncio.create_subprocess_exec(
                sys.executable, "-m", "tts2face.service.synthesis.synthesis_process", json.dumps(dict(self._settings)),
                stdin=asyncio.subprocess.PIPE, stdout=asyncio.subprocess.PIPE,
                env=child_environment(self._settings.get("core")), limit=1 << 20,
            )  # fmt: skip
            try:
                await self._distribute(self._child)
            finally:
                self.is_ready = False
                await self._end()
                self._on_change()

    async def stream(
        self, work: Work, priority: int, inputs: "asyncio.Queue[Any] | None" = None
    ) -> AsyncIterator[Message]:
        """Messages of a task up to END, which is included; leaving the iteration cancels the task.

        Parameters
        ----------
        inputs
            JSON values that are passed on to the task.

        Raises
        ------
        InputError, DataError, BackendError
            As the task.
        ProcessEndedError
            The process ended before the task did.
        """
        self._number += 1
        number, result = self._number, Result()
        self._results[number] = result
        is_done, forwarding = False, None
        try:
            await self._command({
                "do": "start", "task": number, "work": work.as_json(), "priority": priority, "id": REQUEST_ID.get(),
            })  # fmt: skip
            if inputs is not None:
                forwarding = asyncio.create_task(self._forward(number, inputs))
            while not is_done:
                message = await result.messages.get()
                if message is None:
                    is_done = True
                    raise ProcessEndedError("the synthesis process ended; repeat the request")
                is_done = message.kind in {MessageKind.END, MessageKind.ERROR}
                if message.kind == MessageKind.ERROR:
                    error = json.loads(message.payload)
                    raise KINDS.get(error["kind"], BackendError)(error["message"])
                await self._taken(number, result, message)
                yield message
        finally:
            if forwarding is not None:
                forwarding.cancel()
            del self._results[number]
            if not is_done:
                with suppress(ProcessEndedError):
                    await self._command({"do": "cancel", "task": number})

    async def _forward(self, number: int, inputs: "asyncio.Queue[Any]") -> None:
        with suppress(ProcessEndedError):
            while True:
                await self._command({"do": "input", "task": number, "content": await inputs.get()})

    async def close(self) -> None:
        """End the process at once."""
        self.is_closed = True
        if self._child is not None and self._child.returncode is None:
            self._child.kill()

    async def _distribute(self, child: asyncio.subprocess.Process) -> None:
        assert child.stdout is not None
        began = time.monotonic()
        while True:
            try:
                head = await child.stdout.readexactly(HEADER.size)
                number, kind, length, seconds = HEADER.unpack(head)
                if length > MAX_PAYLOAD_BYTES:
                    return
                payload = await child.stdout.readexactly(length)
            except (asyncio.IncompleteReadError, ConnectionError):
                return
            message = Message(number, MessageKind(kind), payload, seconds)
            if message.kind == MessageKind.READY:
                self.is_ready = True
                log_event("synthesis process ready", process=child.pid, seconds=round(time.monotonic() - began, 3))
                self._on_change()
            elif message.kind == MessageKind.CANCELLED:
                self.on_cancelled(json.loads(payload)["seconds"])
            elif number in self._results:
                await self._arrived(number, message)

    async def _arrived(self, number: int, message: Message) -> None:
        result = self._results[number]
        result.messages.put_nowait(message)
        result.n_bytes += len(message.payload)
        if result.n_bytes > PAUSE_BYTES and not result.is_paused:
            result.is_paused = True
            await self._command({"do": "pause", "task": number})

    async def _taken(self, number: int, result: Result, message: Message) -> None:
        result.n_bytes -= len(message.payload)
        if result.is_paused and result.n_bytes < RESUME_BYTES:
            result.is_paused = False
            await self._command({"do": "resume", "task": number})

    async def _command(self, command: dict[str, Any]) -> None:
        child = self._child
        if child is None or child.stdin is None or child.returncode is not None:
            raise ProcessEndedError("the synthesis process ended; repeat the request")
        child.stdin.write(json.dumps(command).encode() + b"\n")
        with suppress(ConnectionError):
            await child.stdin.drain()

    async def _end(self) -> None:
        child, self._child = self._child, None
        if child is not None:
            try:  # killing one that has just ended would take its exit status from asyncio, which warns then
                await asyncio.wait_for(child.wait(), END_S)
            except TimeoutError:
                with suppress(ProcessLookupError):
                    child.kill()
                await child.wait()
        for result in self._results.values():
            result.messages.put_nowait(None)


def _ignore(_: float) -> None:
    pass
