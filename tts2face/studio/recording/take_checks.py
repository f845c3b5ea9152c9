"""Prompts and checks of takes by a process of the tools, and the takes that wait for it.

The process (`corpus_tools.recording_process`) is started by the first order, loads its networks once, and ends when
there was nothing to do for `IDLE_S`.
"""

import asyncio
import json
import sys
from contextlib import suppress
from dataclasses import replace
from typing import Any

from lexicon.errors import BackendError, Tts2faceError
from lexicon.inputs import parse_json
from tts2face.batch.render_process import KINDS
from tts2face.limited_process import bare_environment
from tts2face.studio.recording.store import CACHE, CHECKING, GOOD, REFUSED, WEAK, RecordingStore, Take

PROCESS = "corpus_tools.recording_process"  # by name: the tools stand above this package
ANSWER_S = 120.0  # of one order, with the loading of the networks
IDLE_S = 300.0
LARGEST_ANSWER = 16 << 20  # bytes
REFUSAL = "refusal"  # severity of a finding


class TakeChecks:
    """Checks of takes, one after the other, while the page goes on."""

    def __init__(self, store: RecordingStore) -> None:
        self._store = store
        self._child: asyncio.subprocess.Process | None = None
        self._lock = asyncio.Lock()
        self._waiting: asyncio.Queue[tuple[str, int, Take]] = asyncio.Queue()
        self._worker: asyncio.Task[None] | None = None

    async def prompts(self, minutes: float, language: str, text: str | None) -> dict[str, Any]:
        """Prompts as `corpus_tools.recording_process` gives them; `text` is the path of the user's text.

        Raises
        ------
        InputError, DataError, BackendError
            As `tts2face corpus prompts` says.
        """
        return await self._ask({"kind": "prompts", "minutes": minutes, "language": language, "text": text})

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
        await self._end_child()

    async def _check_all(self) -> None:
        while True:
            try:
                number, at, take = await asyncio.wait_for(self._waiting.get(), IDLE_S)
            except TimeoutError:
                async with self._lock:
                    await self._end_child()
                continue
            await asyncio.to_thread(self._store.judge, number, at, await self._check(number, at, take))

    async def _check(self, number: str, at: int, take: Take) -> Take:
        """The take with its state and, in one line, what to do better."""
        video = self._store.path(number, take)
        if not video.is_file() or take.state != CHECKING:
            return take  # recorded again, or deleted
        order = {
            "kind": "check", "video": str(video), "text": self._store.transcript(number, at),
            "cache": str(video.parents[1] / CACHE),
        }  # fmt: skip
        try:
            answer = await self._ask(order)
        except Tts2faceError as error:
            return replace(take, state=REFUSED, advice=str(error))
        findings = answer["findings"]
        if not findings:
            return replace(take, state=GOOD, key=answer["key"])
        state = REFUSED if findings[0]["severity"] == REFUSAL else WEAK
        return replace(take, state=state, advice=str(findings[0]["message"]), key=answer["key"])

    async def _ask(self, order: dict[str, Any]) -> dict[str, Any]:
        """Answer of the process; it is started anew if it ended."""
        async with self._lock:
            child = self._child if self._child is not None and self._child.returncode is None else await self._start()
            assert child.stdin is not None
            assert child.stdout is not None
            try:
                child.stdin.write(json.dumps(order, ensure_ascii=False).encode() + b"\n")
                await child.stdin.drain()
                line = await asyncio.wait_for(child.stdout.readline(), ANSWER_S)
            except (OSError, TimeoutError, asyncio.CancelledError, ValueError) as failed:
                await self._end_child()
                if isinstance(failed, asyncio.CancelledError):
                    raise
                line = b""
        if not line:
            raise BackendError("the take could not be checked in time; record it again, shorter or smaller")
        answer: dict[str, Any] = parse_json(line.decode(), "the answer of the checks")
        if "error" in answer:
            raise KINDS.get(answer["error"], BackendError)(answer["message"])
        return answer

    async def _start(self) -> asyncio.subprocess.Process:
        self._child = await asyncio.create_subprocess_exec(
            sys.executable, "-m", PROCESS, stdin=asyncio.subprocess.PIPE, stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.DEVNULL, env=bare_environment(), limit=LARGEST_ANSWER,
        )  # fmt: skip
        return self._child

    async def _end_child(self) -> None:
        child, self._child = self._child, None
        if child is not None and child.returncode is None:
            child.kill()
            await child.wait()
