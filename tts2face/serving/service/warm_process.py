"""The server's side of one synthesis process."""

import asyncio
import time
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import aclosing, suppress
from typing import Any

from lexicon.errors import Tts2faceError
from tts2face.processes.async_parent import AsyncChild
from tts2face.processes.message import Message
from tts2face.processes.program import Program
from tts2face.serving.service.logs import REQUEST_ID, log_event
from tts2face.serving.service.messages import SERVE, SYNTHESISE, Work
from tts2face.serving.service.preparation import Preparation

# A name, as the server does not import what its processes do: the session alone takes 1 s of processor time.
PROGRAM = "tts2face.serving.service.synthesis:handlers"
AT_ONCE = 4096  # more calls than the pool gives to one process
FIRST_PAUSE_S, LAST_PAUSE_S = 0.5, 30.0  # before a process that was not ready is started again
InputItem = tuple[Mapping[str, Any], bytes]  # content and payload


def synthesis_program(settings: Mapping[str, Any], *, at_once: int = 1, niceness: int = 0) -> Program:
    """Program of a synthesis process; `settings` as for `tts2face.serving.service.synthesis.handlers`."""
    return Program(PROGRAM, at_once=at_once, niceness=niceness, settings=settings, has_log=True)


def work_call(work: Work, priority: int = 0, key: str = "") -> dict[str, Any]:
    """Content of the call `SYNTHESISE` for a task of the present request; keys share the turns of a process."""
    return {"work": work.as_json(), "priority": priority, "key": key, "id": REQUEST_ID.get()}


class WarmProcess:
    """A synthesis process that is started again when it ends.

    Parameters
    ----------
    settings
        As for `tts2face.serving.service.synthesis.handlers`.
    preparation
        In which it takes part before it is ready.
    on_change
        Called whenever the process becomes ready or ends.
    """

    def __init__(self, settings: Mapping[str, Any], preparation: Preparation, on_change: Callable[[], None]) -> None:
        self._child = AsyncChild(synthesis_program(settings, at_once=AT_ONCE), self._note_released)
        self._preparation, self._on_change = preparation, on_change
        self.is_ready = False
        self._closed, self._pause_s = asyncio.Event(), FIRST_PAUSE_S
        self.on_cancelled: Callable[[float], None] = _ignore  # called with the seconds until a task was released

    @property
    def pid(self) -> int | None:
        """Number of the process."""
        return self._child.pid

    @property
    def is_closed(self) -> bool:
        """Whether it is not started again."""
        return self._closed.is_set()

    async def run(self) -> None:
        """Start the process, and again whenever it ends, until `close`: later and later while it is never ready."""
        while not self.is_closed:
            was_ready = False
            try:
                await self._serve()
            except Tts2faceError as ended:
                if not self.is_closed:
                    log_event("synthesis process ended", reason=str(ended))
            finally:
                was_ready, self.is_ready = self.is_ready, False
                await self._child.close()
                self._on_change()
            await self._rest(was_ready=was_ready)

    async def _rest(self, *, was_ready: bool) -> None:
        pause_s, self._pause_s = self._pause_s, FIRST_PAUSE_S if was_ready else min(2 * self._pause_s, LAST_PAUSE_S)
        if not was_ready:
            with suppress(TimeoutError):
                # a pause that the end of the server cuts short
                await asyncio.wait_for(self._closed.wait(), pause_s)

    async def _serve(self) -> None:
        began = time.monotonic()
        async with aclosing(self._child.stream(SERVE, {})) as served:
            async for _ in served:  # once, as soon as it has loaded
                await self._preparation.run(self._child.call, self)
                self.is_ready = True
                log_event("synthesis process ready", process=self.pid, seconds=round(time.monotonic() - began, 3))
                self._on_change()

    async def stream(
        self, call: Mapping[str, Any], inputs: AsyncIterator[InputItem] | None, on_paused: Callable[[bool], None]
    ) -> AsyncIterator[Message]:
        """Messages of a task up to its result, which is included; leaving the iteration cancels the task.

        Parameters
        ----------
        call
            As of `work_call`.
        inputs
            What is passed on to the task.
        on_paused
            As for `AsyncChild.stream`.

        Raises
        ------
        InputError, DataError, BackendError
            As the task.
        ChildEndedError
            The process ended before the task did.
        """
        async with aclosing(self._child.stream(SYNTHESISE, call, inputs=inputs, on_paused=on_paused)) as messages:
            async for message in messages:
                yield message

    def _note_released(self, seconds: float) -> None:
        self.on_cancelled(seconds)

    async def close(self) -> None:
        """End the process at once."""
        self._closed.set()
        await self._child.close()


def _ignore(_: float) -> None:
    pass
