"""Recordings of the studio at work: the store, the checks of takes, and the building of talkers."""

import asyncio
from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lexicon.errors import InputError, Tts2faceError
from tts2face.studio.recording.store import ACCEPTED_FOLDER, FOLDERS, RecordingStore
from tts2face.studio.recording.take_checks import TakeChecks
from tts2face.studio.recording.talker_building import TALKER, build_talker, speak

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
