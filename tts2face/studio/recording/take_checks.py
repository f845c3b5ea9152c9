"""Prompts and checks of takes by a process of the tools, and the takes that wait for it.

The process (the tool ``recordings``) is started by the first order, loads its networks once, and ends when
there was nothing to do for `IDLE_S`.
"""

import asyncio
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from typing import Any

from lexicon.errors import BackendError, Tts2faceError
from tts2face.processes.limits import ProcessLimits
from tts2face.processes.parent import AsyncChild, ChildEndedError
from tts2face.processes.program import Program
from tts2face.studio.recording.store import CACHE, CHECKING, GOOD, REFUSED, WEAK, RecordingStore, Take

TOOL = "recordings"
LIMITS = ProcessLimits(memory_bytes=4 << 30, cpu_s=100_000, file_bytes=1 << 30, n_files=256)
ANSWER_S = 120.0  # of one order, with the loading of the networks
IDLE_S = 300.0
REFUSAL = "refusal"  # severity of a finding


class TakeChecks:
    """Checks of takes, one after the other, while the page goes on."""

    def __init__(self, store: RecordingStore) -> None:
        self._store = store
        self._child = AsyncChild(Program(TOOL, LIMITS))
        self._waiting: asyncio.Queue[tuple[str, int, Take]] = asyncio.Queue()
        self._worker: asyncio.Task[None] | None = None

    async def prompts(self, minutes: float, language: str, text: str | None) -> Mapping[str, Any]:
        """Prompts as the tool gives them; `text` is the path of the user's text.

        Raises
        ------
        InputError, DataError, BackendError
            As `tts2face corpus prompts` says.
        """
        return await self._ask("prompts", {"minutes": minutes, "language": language, "text": text})

    def start(self) -> None:
        """Check the takes that wait, also those of an earlier run, from now on."""
        if self._worker is None:
            for one in self._store.unchecked():
                self._waiting.put_nowait(one)
            self._worker = asyncio.create_task(self._check_all())

    def add(self, number: str, at: int, take: Take) -> None:
        """Check a new take in its turn."""
        self.start()
        self._waiting.put_nowait((number, at, take))

    async def stop(self) -> None:
        """End the process and the checks; what was not checked is checked after the next start."""
        if self._worker is not None:
            self._worker.cancel()
            with suppress(asyncio.CancelledError):
                await self._worker
        await self._child.close()

    async def _check_all(self) -> None:
        while True:
            try:
                number, at, take = await asyncio.wait_for(self._waiting.get(), IDLE_S)
            except TimeoutError:
                await self._child.close_when_idle()
                continue
            await asyncio.to_thread(self._store.judge, number, at, await self._check(number, at, take))

    async def _check(self, number: str, at: int, take: Take) -> Take:
        """The take with its state and, in one line, what to do better."""
        video = self._store.path(number, take)
        if not video.is_file() or take.state != CHECKING:
            return take  # recorded again, or deleted
        text, cache = self._store.transcript(number, at), str(video.parents[1] / CACHE)
        try:
            answer = await self._ask("check", {"video": str(video), "text": text, "cache": cache})
        except Tts2faceError as error:
            return replace(take, state=REFUSED, advice=str(error))
        findings = answer["findings"]
        if not findings:
            return replace(take, state=GOOD, key=answer["key"])
        state = REFUSED if findings[0]["severity"] == REFUSAL else WEAK
        return replace(take, state=state, advice=str(findings[0]["message"]), key=answer["key"])

    async def _ask(self, kind: str, order: Mapping[str, Any]) -> Mapping[str, Any]:
        """Answer of the process; it is started anew if it ended."""
        try:
            return (await self._child.call(kind, order, timeout_s=ANSWER_S)).content
        except (ChildEndedError, TimeoutError) as failed:
            raise BackendError("the take could not be checked in time; record it again, shorter or smaller") from failed
