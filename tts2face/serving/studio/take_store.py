"""Takes of puppetry on disk: each a Live Link Face table, with its sound if it has any, in a folder of its own.

``takes/ID/take.csv`` and ``sound.wav``; ``take.json`` has name and state, ``owner`` the name of the key;
``preview.bin`` and ``film.mp4`` are made when they are asked for. A video is kept until its table is written. All
methods block.
"""

import json
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from lexicon.errors import DataError, InputError
from lexicon.values.json_text import read_json
from tts2face.serving.studio.owned_folders import OwnedFolders
from tts2face.serving.work.jobs import FAILED
from tts2face.storage.files import write_atomically

ENTRY = "take.json"
TABLE = "take.csv"
SOUND = "sound.wav"
PREVIEW = "preview.bin"
FILM = "film.mp4"
VIDEO = "video"
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
        return [self._read(folder / ENTRY) for folder in self._takes.of(owner)]

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
            # it must be seen to be deleted
            return TakeEntry(file.parent.name, "damaged take", FAILED, message="its file is damaged; delete it")
