"""The server's side of one synthesis process."""

import asyncio
import time
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from contextlib import aclosing
from typing import Any

from lexicon.errors import Tts2faceError
from tts2face.processes.message import Message
from tts2face.processes.parent import AsyncChild
from tts2face.processes.program import Program
from tts2face.service.logs import REQUEST_ID, log_event
from tts2face.service.synthesis.work import SERVE, SYNTHESISE, Work

PROGRAM = "tts2face.service.synthesis.synthesis_process:handlers"
AT_ONCE = 64  # more calls than the pool gives to one process

InputQueue = asyncio.Queue[tuple[Mapping[str, Any], bytes]]  # contents and payloads


class WarmProcess:
    """A synthesis process that is started again when it ends.

    Parameters
    ----------
    settings
        As for `tts2face.service.synthesis.synthesis_process.handlers`.
    warm
        Works, as `Work.as_json`, that load models and compile kernels before the process is ready.
    on_change
        Called whenever the process becomes ready or ends.
    core
        Core to which it is bound; None: all.
    """

    def __init__(
        self, settings: Mapping[str, Any], warm: Sequence[Mapping[str, Any]], on_change: Callable[[], None],
        core: int | None = None,
    ) -> None:  # fmt: skip
        program = Program(PROGRAM, core=core, at_once=AT_ONCE, settings=settings, has_log=True)
        self._child = AsyncChild(program, self._note_released)
        self._warm, self._on_change = warm, on_change
        self.is_ready = False
        self.is_closed = False
        self.on_cancelled: Callable[[float], None] = _ignore  # called with the seconds until a task was released
        self.load = 0.0  # sum of the costs of its tasks

    @property
    def pid(self) -> int | None:
        """Number of the process."""
        return self._child.pid

    async def run(self) -> None:
        """Start the process, and start it again whenever it ends, until `close`."""
        while not self.is_closed:
            try:
                await self._serve()
            except Tts2faceError as ended:
                if not self.is_closed:
                    log_event("synthesis process ended", reason=str(ended))
            finally:
                self.is_ready = False
                await self._child.close()
                self._on_change()

    async def _serve(self) -> None:
        began = time.monotonic()
        async with aclosing(self._child.stream(SERVE, {})) as served:
            async for _ in served:  # once, as soon as it has loaded
                for work in self._warm:
                    await self._child.call(SYNTHESISE, {"work": work, "priority": 0, "id": None})
                self.is_ready = True
                log_event("synthesis process ready", process=self.pid, seconds=round(time.monotonic() - began, 3))
                self._on_change()

    async def stream(self, work: Work, priority: int, inputs: InputQueue | None = None) -> AsyncIterator[Message]:
        """Messages of a task up to its result, which is included; leaving the iteration cancels the task.

        Parameters
        ----------
        inputs
            What is passed on to the task.

        Raises
        ------
        InputError, DataError, BackendError
            As the task.
        ChildEndedError
            The process ended before the task did.
        """
        content = {"work": work.as_json(), "priority": priority, "id": REQUEST_ID.get()}
        given = None if inputs is None else _items(inputs)
        async with aclosing(self._child.stream(SYNTHESISE, content, inputs=given)) as messages:
            async for message in messages:
                yield message

    def _note_released(self, seconds: float) -> None:
        self.on_cancelled(seconds)

    async def close(self) -> None:
        """End the process at once."""
        self.is_closed = True
        await self._child.close()


async def _items(inputs: InputQueue) -> AsyncIterator[tuple[Mapping[str, Any], bytes]]:
    while True:
        yield await inputs.get()


def _ignore(_: float) -> None:
    pass
