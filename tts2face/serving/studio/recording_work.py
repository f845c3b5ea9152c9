"""Recordings of the studio at work: the store, the checks of takes, and the building of talkers.

Prompts and checks are made by a process of the tool ``recordings``. It is started by the first order, loads its
networks once, and ends when there was nothing to do for `IDLE_S`.
"""

import asyncio
import os
import shutil
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from lexicon.errors import BackendError, InputError
from tts2face.models.consent import consent_record
from tts2face.processes.async_parent import AsyncChild
from tts2face.processes.parent import ChildEndedError
from tts2face.processes.program import ProcessLimits, Program
from tts2face.serving.service.decoders import KeyTurns, Shares
from tts2face.serving.service.keys import ApiKey
from tts2face.serving.studio.recorded_talker import CLIP, REPORT, TALKER, speak
from tts2face.serving.studio.recordings import (
    ACCEPTED_FOLDER,
    CACHE,
    FOLDERS,
    REFUSED,
    UNCHECKED_FOLDER,
    PromptTake,
    RecordingStore,
    judge,
)
from tts2face.serving.studio.work import BackgroundWork, WorkKind, WorkList
from tts2face.serving.work.jobs import FAILED
from tts2face.serving.work.tools import TALKER_TOOL, run_tool, talker_build

TOOL = "recordings"
TOOL_LIMITS = ProcessLimits(memory_bytes=4 << 30, cpu_s=100_000, file_bytes=1 << 30, n_files=256)
ANSWER_S = 120.0  # of one order, with the loading of the networks
# after which the process with its networks ends
IDLE_S = 300.0
# as `lexicon.sentence_length.MAX_SENTENCE_CHARACTERS`
MAX_SENTENCE_CHARACTERS = 300
# tasks of the work on a recording, and the kind of work on its takes
BUILD = "build"
SAY = "say"
CHECK = "check"
WORK, ORDER = "recording", "work.json"  # kind of work, and its order in the folder of a recording
PLACES = 5  # recordings of an owner
MADE, CHECKED = "made.talker", "checked"  # as the builder names them
MAX_TALKER_BYTES = 500e6
SECONDS_A_TAKE = 10.0  # at most, for the limit of time
N_SHOWN = 5  # refused takes
BUILDS = Shares(1, 1, 1000)  # talkers that are built: each takes a core and 1 GB for up to an hour


class Recordings:
    """Recordings of all keys of a studio; methods belong to the event loop."""

    def __init__(self, folder: Path, work: WorkList) -> None:
        self.store, self._work = RecordingStore(folder), work
        self._tool, self._turn = AsyncChild(Program(TOOL, TOOL_LIMITS)), asyncio.Lock()
        self._used_at, self._builds = 0.0, KeyTurns(BUILDS)
        self._ending: asyncio.Task[None] | None = None
        busy = "the last order still runs; wait for it, or cancel it"
        late = "the work took too long; try it with fewer takes"
        orders = f"recordings/*/{ORDER}"
        work.register(WorkKind(WORK, orders, self._run, stage="starting", places=PLACES, busy=busy, late=late))
        work.register(WorkKind(CHECK, f"recordings/*/{UNCHECKED_FOLDER}/*.json", self._check, end=self._end_check))

    async def prompts(self, minutes: float, language: str, text: str | None) -> Mapping[str, Any]:
        """Prompts as the tool gives them; `text` is the path of the user's text.

        Raises
        ------
        InputError, DataError, BackendError
            As `tts2face corpus prompts` says.
        """
        return await self._ask("prompts", {"minutes": minutes, "language": language, "text": text})

    def start(self) -> None:
        """Check takes whose check has not begun."""
        for number, at, take in self.store.unchecked():
            with suppress(InputError):  # its work goes on
                self.check(number, at, take)

    def check(self, number: str, at: int, take: PromptTake) -> None:
        """Check a new take in its turn."""
        order = self.store.at(number) / UNCHECKED_FOLDER / f"{take.file}.json"
        self._work.add(CHECK, self.store.owner(number), order, {"at": at})

    def work_on(self, number: str) -> BackgroundWork | None:
        """The last work on a recording since the server began."""
        return self._work.get(self.store.at(number) / ORDER)

    def accepted(self, number: str) -> list[int]:
        """Indices of the prompts with an accepted take."""
        return [at for at, take in self.store.takes(number).items() if FOLDERS[take.state] == ACCEPTED_FOLDER]

    def build(self, number: str, consent: str) -> None:
        """Start to build the talker.

        Raises
        ------
        InputError
            There is no accepted take, the consent is none, or the recording is at work already.
        """
        if not self.accepted(number):
            raise InputError("there is no accepted take; record some prompts")
        stated = consent_record(self.store.name(number), consent)
        self._start(number, {"task": BUILD, "consent": stated["statement"]})

    def speak(self, number: str, text: str) -> None:
        """Start to make the clip of a sentence.

        Raises
        ------
        InputError
            There is no talker yet, the sentence is empty or too long, or the recording is at work already.
        """
        if not (self.store.at(number) / TALKER).is_file():
            raise InputError("there is no talker yet; build it first")
        if not text.strip() or len(text) > MAX_SENTENCE_CHARACTERS:
            raise InputError(f"the sentence must have 1 to {MAX_SENTENCE_CHARACTERS} characters; change it")
        self._start(number, {"task": SAY, "text": text})

    def cancel(self, number: str) -> None:
        """End the work on a recording."""
        work = self.work_on(number)
        if work is not None:
            self._work.cancel(work)

    async def delete(self, number: str) -> None:
        """End the work on a recording and its takes, and delete all of it."""
        await self._work.forget(self.store.at(number))
        await asyncio.to_thread(self.store.delete, number)

    async def close(self) -> None:
        """End the process of the tool."""
        if self._ending is not None:
            self._ending.cancel()
        await self._tool.close()

    def _start(self, number: str, content: Mapping[str, Any]) -> None:
        self._work.add(WORK, self.store.owner(number), self.store.at(number) / ORDER, content)

    async def _run(self, work: BackgroundWork) -> str:
        folder, content = work.order.parent, work.content
        if content["task"] == SAY:
            work.show("rendering the clip", 0, 0)
            await speak(folder, content["text"])
            return "The clip is ready."
        n_takes, name = len(self.accepted(folder.name)), self.store.name(folder.name)
        consent = content["consent"]
        async with self._builds.turn(work.owner):
            return await build_talker(folder, name=name, consent=consent, n_takes=n_takes, on_message=work.show)

    async def _check(self, work: BackgroundWork) -> str:
        """Give the take its state and, in one line, what to do better."""
        folder, at = work.order.parents[1], work.content["at"]
        take = self.store.takes(folder.name).get(at)
        if take is None or take.file != work.id:
            return ""  # recorded again, or deleted
        order = {
            "video": str(self.store.path(folder.name, take)), "text": self.store.transcript(folder.name, at),
            "cache": str(folder / CACHE),
        }  # fmt: skip
        answer = await self._ask("check", order)
        state, advice = judge(answer["findings"])
        judged = replace(take, state=state, advice=advice, key=answer["key"])
        await asyncio.to_thread(self.store.judge, folder.name, at, judged)
        return advice

    def _end_check(self, work: BackgroundWork) -> None:
        if work.state == FAILED:
            number, refused = work.order.parents[1].name, PromptTake(work.id, REFUSED, work.message)
            self.store.judge(number, work.content.get("at", -1), refused)

    async def _ask(self, kind: str, order: Mapping[str, Any]) -> Mapping[str, Any]:
        """Answer of the tool, to one order after the other; its process is started anew if it ended."""
        async with self._turn:
            try:
                return (await self._tool.call(kind, order, timeout_s=ANSWER_S)).content
            except (ChildEndedError, TimeoutError) as failed:
                reason = "the take could not be checked in time; record it again, shorter or smaller"
                raise BackendError(reason) from failed
            finally:
                self._used_at = asyncio.get_running_loop().time()
                if self._ending is None or self._ending.done():
                    self._ending = asyncio.create_task(self._end_when_idle())

    async def _end_when_idle(self) -> None:
        while (left_s := self._used_at + IDLE_S - asyncio.get_running_loop().time()) > 0:
            await asyncio.sleep(left_s)
        await self._tool.close_when_idle()


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
    order = {
        "folder": str(folder), "name": name, "consent": consent, "provenance": {"name": name},
        "with_appearance": True, "max_bytes": MAX_TALKER_BYTES,
    }  # fmt: skip
    build = talker_build(SECONDS_A_TAKE * n_takes)
    result = await run_tool(
        build.program, TALKER_TOOL, order, on_message, what="the recording", timeout_s=build.timeout_s
    )
    os.replace(folder / MADE, folder / TALKER)
    shutil.rmtree(folder / CHECKED, ignore_errors=True)
    refused = "; ".join(f"{take}: {reason}" for take, reason in result["refused"][:N_SHOWN])
    minutes = f"{result['n_kept']} takes, {result['minutes']:.1f} minutes"
    return f"The talker {name} is made of {minutes}." + (f" Refused: {refused}." if refused else "")


def recording_owner(key: ApiKey) -> str:
    """Name of a key that may build talkers."""
    if "build" not in key.scopes:
        raise InputError(
            f"the key {key.name} lacks the scope build, which recordings need; ask the operator for a key with it "
            "(`tts2face keys add NAME --scope speak --scope build`)"
        )
    return key.name
