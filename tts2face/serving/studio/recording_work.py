"""Recordings of the studio at work: the store, the checks of takes, and the building of talkers.

Prompts and checks of takes by a process of the tools, and the takes that wait for it.

The process (the tool ``recordings``) is started by the first order, loads its networks once, and ends when
there was nothing to do for `IDLE_S`.

A talker from the accepted takes of a recording, and its first sentence, each in a child process.

The building is that of the service's jobs (the tool ``talker``), with its limits.
"""

import asyncio
import os
import shutil
from collections.abc import Callable, Coroutine, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path
from types import MappingProxyType
from typing import Any

from lexicon.errors import BackendError, InputError, Tts2faceError
from tts2face.processes.child import Call, Handler
from tts2face.processes.parent import AsyncChild, ChildEndedError, call_once
from tts2face.processes.program import ProcessLimits, Program
from tts2face.processes.tools import run_tool
from tts2face.serving.studio.recordings import (
    ACCEPTED_FOLDER,
    CACHE,
    CHECKING,
    FOLDERS,
    GOOD,
    REFUSED,
    WEAK,
    RecordingStore,
    Take,
)
from tts2face.serving.work.kinds import BUILDER, CPU_S, CPU_S_PER_S, LIMITS, SLOWNESS

TOOL = "recordings"
CHECK_LIMITS = ProcessLimits(memory_bytes=4 << 30, cpu_s=100_000, file_bytes=1 << 30, n_files=256)
ANSWER_S = 120.0  # of one order, with the loading of the networks
IDLE_S = 300.0
REFUSAL = "refusal"  # severity of a finding


class TakeChecks:
    """Checks of takes, one after the other, while the page goes on."""

    def __init__(self, store: RecordingStore) -> None:
        self._store = store
        self._child = AsyncChild(Program(TOOL, CHECK_LIMITS))
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


TALKER, REPORT, CLIP = "talker.talker", "report.html", "first.mp4"  # files in the folder of a recording
MADE, CHECKED = "made.talker", "checked"  # as the builder names them
MAX_TALKER_BYTES = 500e6
SECONDS_A_TAKE = 10.0  # at most, for the limit of time
CLIP_S = 600.0  # limit of the first sentence
CLIP_LIMITS = ProcessLimits(memory_bytes=4 << 30, cpu_s=600, file_bytes=1 << 30, n_files=256)
SPEAK = "speak"  # name of the call
N_SHOWN = 5  # refused takes


async def build_talker(folder: Path, *, name: str, consent: str, n_takes: int, on_message: Callable[..., None]) -> str:
    """Build the talker of a recording with its own face; one sentence about it.

    Parameters
    ----------
    on_message
        Called with the stage, and the steps done and of all.

    Raises
    ------
    InputError, DataError, BackendError
        As `tts2face corpus build` says.
    """
    for old in (TALKER, REPORT, CLIP, MADE):
        (folder / old).unlink(missing_ok=True)
    shutil.rmtree(folder / CHECKED, ignore_errors=True)
    cpu_s = int(CPU_S + CPU_S_PER_S * SECONDS_A_TAKE * n_takes)
    order = {
        "folder": str(folder), "name": name, "provenance": {"name": name}, "consent": consent,
        "with_appearance": True, "with_report": find_spec("matplotlib") is not None, "max_bytes": MAX_TALKER_BYTES,
    }  # fmt: skip
    program = Program(BUILDER, replace(LIMITS, cpu_s=cpu_s))
    result = await run_tool(program, BUILDER, order, on_message, what="the recording", timeout_s=SLOWNESS * cpu_s)
    os.replace(folder / MADE, folder / TALKER)
    shutil.rmtree(folder / CHECKED, ignore_errors=True)
    refused = "; ".join(f"{take}: {reason}" for take, reason in result["refused"][:N_SHOWN])
    minutes = f"{result['n_kept']} takes, {result['minutes']:.1f} minutes"
    return f"The talker {name} is made of {minutes}." + (f" Refused: {refused}." if refused else "")


async def speak(folder: Path, text: str) -> None:
    """Write the clip of a sentence with the talker's own face.

    Raises
    ------
    InputError
        The sentence cannot be said.
    BackendError
        The clip could not be made in time.
    """
    order = {"talker": str(folder / TALKER), "text": text, "out": str(folder / CLIP)}
    try:
        await call_once(Program(f"{__name__}:HANDLERS", CLIP_LIMITS), SPEAK, order, timeout_s=CLIP_S)
    except TimeoutError as late:
        raise BackendError("the clip took too long; give a shorter sentence") from late


def _speak(call: Call) -> dict[str, Any]:
    from tts2face.session.session import Session

    call.hide(Path(call.content["out"]).parent)
    Session(talker=call.content["talker"], face="self").write(call.content["text"], call.content["out"])
    return {}


HANDLERS: Mapping[str, Handler] = MappingProxyType({SPEAK: _speak})


MAX_SENTENCE_CHARACTERS = 300


@dataclass(slots=True)
class Progress:
    """Work on one recording: its stage with steps done and of all while it runs, then one sentence, or an error."""

    stage: str = ""
    done: int = 0
    of: int = 0
    is_running: bool = True
    message: str = ""
    error: str = ""

    def show(self, stage: str, done: int, of: int) -> None:
        """Set the stage and its steps."""
        self.stage, self.done, self.of = stage, done, of


class Recordings:
    """Recordings in a data folder; its methods run in the event loop of the server."""

    def __init__(self, folder: Path) -> None:
        self.store = RecordingStore(folder)
        self.checks = TakeChecks(self.store)
        self._progress: dict[str, Progress] = {}
        self._tasks: dict[str, asyncio.Task[None]] = {}

    def progress(self, number: str) -> Progress | None:
        """Latest work on a recording since the server started."""
        return self._progress.get(number)

    def accepted(self, number: str) -> list[int]:
        """Indices of the prompts with an accepted take."""
        return [at for at, take in self.store.takes(number).items() if FOLDERS[take.state] == ACCEPTED_FOLDER]

    def build(self, number: str, folder: Path, consent: str) -> None:
        """Start to build the talker.

        Raises
        ------
        InputError
            There is no accepted take, or the recording is at work already.
        """
        n_takes, name = len(self.accepted(number)), self.store.name(number)
        if not n_takes:
            raise InputError("there is no accepted take; record some prompts")
        self._start(
            number,
            lambda show: build_talker(folder, name=name, consent=consent, n_takes=n_takes, on_message=show),
        )

    def speak(self, number: str, folder: Path, text: str) -> None:
        """Start to make the clip of a sentence.

        Raises
        ------
        InputError
            There is no talker yet, the sentence is empty or too long, or the recording is at work already.
        """
        if not (folder / TALKER).is_file():
            raise InputError("there is no talker yet; build it first")
        if not text.strip() or len(text) > MAX_SENTENCE_CHARACTERS:
            raise InputError(f"the sentence must have 1 to {MAX_SENTENCE_CHARACTERS} characters; change it")

        async def make(show: Callable[[str, int, int], None]) -> str:
            show("rendering the clip", 0, 0)
            await speak(folder, text)
            return "The clip is ready."

        self._start(number, make)

    async def cancel(self, number: str) -> None:
        """End the work on a recording."""
        task = self._tasks.get(number)
        if task is not None:
            task.cancel()
            await asyncio.wait([task])

    async def delete(self, number: str) -> None:
        """End the work on a recording and delete all of it."""
        await self.cancel(number)
        self._progress.pop(number, None)
        self._tasks.pop(number, None)
        await asyncio.to_thread(self.store.delete, number)

    async def stop(self) -> None:
        """End the processes."""
        for number in list(self._tasks):
            await self.cancel(number)
        await self.checks.stop()

    def _start(self, number: str, work: Callable[[Callable[[str, int, int], None]], Coroutine[Any, Any, str]]) -> None:
        running = self._progress.get(number)
        if running is not None and running.is_running:
            raise InputError("the last order still runs; wait for it, or cancel it")
        progress = self._progress[number] = Progress("starting")

        async def follow() -> None:
            try:
                progress.message = await work(progress.show)
            except Tts2faceError as error:
                progress.error = str(error)
            except TimeoutError:
                progress.error = "the work took too long; try it with fewer takes"
            except asyncio.CancelledError:
                progress.error = "cancelled"
            finally:
                progress.is_running = False

        self._tasks[number] = asyncio.create_task(follow())
