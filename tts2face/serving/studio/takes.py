"""Takes of puppetry at work: read from videos and tables, shown on the stage, made films, styles and projects.

Takes of puppetry on disk: each a Live Link Face table, with its sound if it has any, in a folder of its own.

``takes/ID/take.csv`` and ``sound.wav``; ``take.json`` has name and state, ``owner`` the name of the key;
``preview.bin`` and ``film.mp4`` are made when they are asked for. A video is kept until its table is written. All
methods block.
"""

import asyncio
import json
import os
import shutil
import struct
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from lexicon.errors import DataError, InputError
from lexicon.values.json_text import read_json
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.keys import ApiKey
from tts2face.serving.studio.importing import StudioHost, add_recording
from tts2face.serving.studio.recordings import OwnedFolders
from tts2face.serving.studio.requests import events_of
from tts2face.serving.studio.store import SUFFIXES
from tts2face.serving.studio.styles import Styles
from tts2face.serving.studio.work import BackgroundWork, WorkKind
from tts2face.serving.work.table import FAILED
from tts2face.serving.work.uploaded_file import SOUND as SOUND_KIND
from tts2face.storage.files import translate_disk_errors, write_atomically

ENTRY, TABLE, SOUND, PREVIEW, FILM, VIDEO = (
    "take.json", "take.csv", "sound.wav", "preview.bin", "film.mp4", "video",
)  # fmt: skip
READING, READY = "reading", "ready"  # states of a take, besides FAILED
MAX_NAME = 60
MAX_TAKES = 200  # of an owner


@dataclass(frozen=True, slots=True)
class TakeEntry:
    """A take: its state, its seconds when it is ready, and one sentence about what failed."""

    id: str
    name: str
    state: str
    seconds: float = 0.0
    has_sound: bool = False
    message: str = ""


class TakeStore:
    """Takes of all owners in the folder of a studio."""

    def __init__(self, studio: Path) -> None:
        self._takes = OwnedFolders(studio / "takes", ENTRY, "take")

    def create(self, owner: str, name: str) -> TakeEntry:
        """A new take, which is being read.

        Raises
        ------
        InputError
            The owner has too many.
        """
        if len(self.entries(owner)) >= MAX_TAKES:
            raise InputError(f"there are {MAX_TAKES} takes already; delete one")
        number = self._takes.make(owner).name
        entry = TakeEntry(number, " ".join(name.split())[:MAX_NAME] or "take", READING)
        self.write(entry)
        return entry

    def entries(self, owner: str) -> list[TakeEntry]:
        """Takes of an owner, those changed last first."""
        return [self._read(one / ENTRY) for one in self._takes.of(owner)]

    def entry(self, owner: str, number: str) -> TakeEntry:
        """A take; errors as `folder`."""
        return self._read(self.folder(owner, number) / ENTRY)

    def folder(self, owner: str, number: str) -> Path:
        """Folder of a take.

        Raises
        ------
        InputError
            The owner has no such take.
        """
        return self._takes.find(number, owner)

    def write(self, entry: TakeEntry) -> None:
        """Write a take's state, unless it was deleted."""
        folder = self._takes.at(entry.id)
        if folder.is_dir():
            write_atomically(folder / ENTRY, json.dumps(asdict(entry), ensure_ascii=False).encode())

    def remove(self, owner: str, number: str) -> None:
        """Delete a take with all that was made of it; errors as `folder`."""
        self._takes.remove(self.folder(owner, number).name)

    def rename(self, owner: str, number: str, name: str) -> None:
        """Give a take another name; errors as `folder`."""
        name = " ".join(name.split())
        if not 0 < len(name) <= MAX_NAME:
            raise InputError(f"the name must have 1 to {MAX_NAME} characters; write another one")
        self.write(replace(self.entry(owner, number), name=name))

    def readings(self) -> list[Path]:
        """Folders of the takes of all owners that are being read."""
        return [folder for folder in self._takes.of() if self._read(folder / ENTRY).state == READING]

    def end_reading(self, folder: Path, message: str) -> None:
        """Delete the video of a take, of which nothing but motion and sound is kept; if it is not read, it failed."""
        for video in folder.glob(f"{VIDEO}.*"):
            video.unlink()
        entry = self._read(folder / ENTRY)
        if entry.state == READING:
            self.write(replace(entry, state=FAILED, message=message))

    @staticmethod
    def _read(file: Path) -> TakeEntry:
        try:
            content: dict[str, Any] = read_json(file)
            return TakeEntry(**content)
        except (OSError, DataError, TypeError):
            return TakeEntry(file.parent.name, "damaged take", FAILED, message="its file is damaged; delete it")


WORK, ORDER = "take", "work.json"  # kind of work, and its order in the folder of a take
READ, MAKE_FILM = "read", "film"  # tasks of the work
QUIET_RATE = 8000  # Hz of the silence that a take without sound has on the stage, whose clock it is
FLOAT_BYTES = 4


class Takes:
    """Takes of all keys of a studio; methods belong to the event loop."""

    def __init__(self, studio: StudioHost, styles: Styles) -> None:
        self._studio, self._styles = studio, styles
        self.store = TakeStore(studio.folder)
        self.live: set[str] = set()  # names of the keys with a live camera
        busy = "the take is at work already; wait until it is done"
        late = "the take needs too much time; record a shorter one"
        orders = f"takes/*/{ORDER}"
        studio.work.register(WorkKind(WORK, orders, self._run, end=self._end, stage="waiting", busy=busy, late=late))

    def work_on(self, key: ApiKey, number: str) -> BackgroundWork | None:
        """The last work on a take since the server began; errors as `TakeStore.folder`."""
        return self._studio.work.get(self.store.folder(key.name, number) / ORDER)

    def start(self) -> None:
        """Mark takes as failed that nothing reads on."""
        for folder in self.store.readings():
            if self._studio.work.get(folder / ORDER) is None:
                self.store.end_reading(folder, "the server stopped while it was read; record or upload it again")

    async def add(self, key: ApiKey, source: Path, suffix: str, name: str) -> TakeEntry:
        """A new take of a video or a table, which is read from now on; the file is moved.

        Raises
        ------
        InputError
            The key may not build, or the file is of another kind.
        """
        self._styles.check_scope(key)
        if suffix not in SUFFIXES:
            raise InputError(f"a take {suffix[:10]!r} cannot be read; give {', '.join(sorted(SUFFIXES))}")
        entry = await asyncio.to_thread(self.store.create, key.name, name)
        file = self.store.folder(key.name, entry.id) / (TABLE if suffix == ".csv" else f"{VIDEO}{suffix}")
        with translate_disk_errors(file):
            await asyncio.to_thread(shutil.move, source, file)
        self._studio.work.add(WORK, key.name, file.parent / ORDER, {"task": READ, "file": file.name})
        return entry

    async def add_sound(self, key: ApiKey, number: str, source: Path) -> None:
        """Give a take the sound of a file.

        Raises
        ------
        InputError
            There is no such take, or the file has no sound that can be decoded.
        """
        self._styles.check_scope(key)
        folder, settings = self.store.folder(key.name, number), self._studio.state.settings
        try:
            arguments = SOUND_KIND, source, folder / f"new-{SOUND}", settings.sound_s
            await self._studio.state.decoders.decode(key.name, arguments, "the sound", settings.decode_s)
        except RefusedError as refused:
            raise InputError(refused.message) from refused
        os.replace(folder / f"new-{SOUND}", folder / SOUND)
        for made in (PREVIEW, FILM):
            (folder / made).unlink(missing_ok=True)
        self.store.write(replace(self.store.entry(key.name, number), has_sound=True))

    async def preview(self, key: ApiKey, number: str) -> bytes:
        """The take on the default head, as a preview bundle (docs/studio.md)."""
        folder, entry = self._ready(key, number)
        file = folder / PREVIEW
        if not file.is_file():
            sound = str(folder / SOUND) if entry.has_sound else None
            work = self._studio.state.work(kind="take", request={"take": str(folder / TABLE), "sound": sound})
            async for event, content in events_of(self._studio.state.messages(work, key)):
                await asyncio.to_thread(write_atomically, file, take_bundle(event, content))
        return await asyncio.to_thread(file.read_bytes)

    def film(self, key: ApiKey, number: str) -> None:
        """Begin to render the take as a film."""
        folder, _ = self._ready(key, number)
        self._studio.work.add(WORK, key.name, folder / ORDER, {"task": MAKE_FILM})

    async def make_style_take(self, key: ApiKey, number: str) -> None:
        """Make the take the one of which a style is made; errors as `Styles.add_take`."""
        folder, entry = self._ready(key, number)
        copied = folder / "copy.csv"
        await asyncio.to_thread(shutil.copyfile, folder / TABLE, copied)
        await self._styles.add_take(key, copied, ".csv", folder / SOUND if entry.has_sound else None)

    async def make_project(self, key: ApiKey, number: str) -> str:
        """Id of a new project with the take's sound.

        Raises
        ------
        InputError
            It has none.
        """
        folder, entry = self._ready(key, number)
        if not entry.has_sound:
            raise InputError("the take has no sound, which a project needs; add a sound to it first")
        return await add_recording(self._studio, key, folder / SOUND, entry.name, "")

    async def remove(self, key: ApiKey, number: str) -> None:
        """End the work on a take and delete it; errors as `TakeStore.folder`."""
        await self._studio.work.forget(self.store.folder(key.name, number))
        await asyncio.to_thread(self.store.remove, key.name, number)

    def _ready(self, key: ApiKey, number: str) -> tuple[Path, TakeEntry]:
        folder, entry = self.store.folder(key.name, number), self.store.entry(key.name, number)
        if entry.state != READY:
            raise InputError(f"the take {entry.name} is not ready; wait until it is read, or delete it")
        return folder, entry

    async def _run(self, work: BackgroundWork) -> str:
        folder = work.order.parent
        entry = self.store.entry(work.owner, folder.name)
        if work.content["task"] == MAKE_FILM:
            sound = str(folder / SOUND) if entry.has_sound else None
            order = {"take": str(folder / TABLE), "sound": sound, "out": str(folder / FILM)}
            await self._studio.state.decoders.read_take(work.owner, "film", order, work.show)
        else:
            found = await self._read(work, folder / work.content["file"])
            entry = self.store.entry(work.owner, folder.name)  # it may have another name now
            ready = replace(entry, state=READY, seconds=found["seconds"], has_sound=found.get("has_sound", False))
            self.store.write(ready)
        return ""

    async def _read(self, work: BackgroundWork, file: Path) -> Mapping[str, Any]:
        """What the tool says of a table, or of a video from which it makes one."""
        decoders = self._studio.state.decoders
        if file.name != TABLE:
            order = {"take": str(file), "table": str(file.with_name(TABLE)), "sound": str(file.with_name(SOUND))}
            return await decoders.read_take(work.owner, "capture", order, work.show)
        order = {"take": str(file), "cache": str(file.parent)}
        found = await decoders.read_take(work.owner, "check", order, work.show)
        if not found["seconds"]:
            raise InputError(found["findings"][0]["message"])
        return found

    def _end(self, work: BackgroundWork) -> None:
        if work.content.get("task") == READ:
            self.store.end_reading(work.order.parent, work.message)


def take_bundle(described: dict[str, Any], content: bytes) -> bytes:
    """A preview bundle of a take as the task ``take`` describes it; silence where it has no sound."""
    rate, n_samples, seconds = described["rate"], described["n_samples"], described["seconds"]
    if not n_samples:
        rate, n_samples = QUIET_RATE, round(QUIET_RATE * seconds)
        content += np.zeros(n_samples, "<i2").tobytes()
    n_frames = described["n_frames"]
    header = {
        "revision": 0, "is_complete": True, "fps": described["fps"], "n_frames": n_frames, "first_frame": 0,
        "n": n_frames, "channels": described["channels"], "rate": rate, "n_samples": n_samples, "sound_first": 0,
        "n_sound": n_samples, "duration": seconds, "words": [], "phones": [], "sentences": [], "notes": [], "error": "",
    }  # fmt: skip
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % FLOAT_BYTES)
    return struct.pack("<I", len(text)) + text + content
