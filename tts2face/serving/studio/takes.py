"""Takes of puppetry at work: read from videos and tables, shown on the stage, made films, styles and projects."""

import asyncio
import json
import os
import shutil
import struct
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from lexicon.errors import InputError
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.keys import ApiKey
from tts2face.serving.studio.importing import add_recording
from tts2face.serving.studio.palette_store import SUFFIXES
from tts2face.serving.studio.requests import events_of
from tts2face.serving.studio.studio_host import StudioHost
from tts2face.serving.studio.styles import Styles
from tts2face.serving.studio.take_store import FILM, PREVIEW, READY, SOUND, TABLE, VIDEO, TakeEntry, TakeStore
from tts2face.serving.studio.work import BackgroundWork, WorkKind
from tts2face.serving.work.uploaded_file import SOUND as SOUND_KIND
from tts2face.serving.work.uploaded_file import FileOrder
from tts2face.storage.files import translate_disk_errors, write_atomically

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

    async def add_sound(self, key: ApiKey, number: str, source: Path) -> tuple[str, ...]:
        """Give a take the sound of a file; sentences on what is guessed of it.

        Raises
        ------
        InputError
            There is no such take, or the file has no sound that can be decoded.
        """
        self._styles.check_scope(key)
        folder, settings = self.store.folder(key.name, number), self._studio.state.settings
        try:
            order = FileOrder(SOUND_KIND, source, folder / f"new-{SOUND}", settings.sound_s)
            notes = await self._studio.state.decoders.decode(key.name, order, "the sound", settings.decode_s)
        except RefusedError as refused:
            raise InputError(refused.message) from refused
        os.replace(folder / f"new-{SOUND}", folder / SOUND)
        for made in (PREVIEW, FILM):
            (folder / made).unlink(missing_ok=True)
        self.store.write(replace(self.store.entry(key.name, number), has_sound=True))
        return notes

    async def preview(self, key: ApiKey, number: str) -> bytes:
        """The take on the default head, as a preview bundle (docs/studio.md)."""
        folder, entry = self._ready(key, number)
        file = folder / PREVIEW
        if not file.is_file():
            sound = str(folder / SOUND) if entry.has_sound else None
            work = self._studio.state.results.work(kind="take", request={"take": str(folder / TABLE), "sound": sound})
            async for event, content in events_of(self._studio.state.results.messages(work, key)):
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
        """Id of a new project with the take's sound."""
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
        """Answer of the tool about a table, or about a video from which it makes one."""
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
    rate = described["rate"]
    n_samples = described["n_samples"]
    seconds = described["seconds"]
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
