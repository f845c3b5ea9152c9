"""Takes of puppetry on disk: each a Live Link Face table, with its sound if it has any, in a folder of its own.

``takes/ID/take.csv`` and ``sound.wav``; ``take.json`` has name and state, ``owner`` the name of the key;
``preview.bin`` and ``film.mp4`` are made when they are asked for. A video is kept until its table is written. All
methods block.
"""

import json
import re
import secrets
import shutil
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from lexicon.errors import DataError, InputError
from lexicon.inputs import read_json
from tts2face.storage.files import translate_disk_errors, write_atomically

ID = re.compile(r"[0-9a-f]{16}")
ENTRY, OWNER, TABLE, SOUND, PREVIEW, FILM, VIDEO = (
    "take.json", "owner", "take.csv", "sound.wav", "preview.bin", "film.mp4", "video",
)  # fmt: skip
READING, READY, FAILED = "reading", "ready", "failed"  # states of a take
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
        self._folder = studio / "takes"

    def create(self, owner: str, name: str) -> TakeEntry:
        """A new take, which is being read.

        Raises
        ------
        InputError
            The owner has too many.
        """
        if len(self.entries(owner)) >= MAX_TAKES:
            raise InputError(f"there are {MAX_TAKES} takes already; delete one")
        entry = TakeEntry(secrets.token_hex(8), " ".join(name.split())[:MAX_NAME] or "take", READING)
        folder = self._folder / entry.id
        with translate_disk_errors(folder):
            folder.mkdir(parents=True)
            (folder / OWNER).write_text(owner, encoding="utf-8")
        self.write(entry)
        return entry

    def entries(self, owner: str) -> list[TakeEntry]:
        """Takes of an owner, the last one first."""
        files = [file for file in self._folder.glob(f"*/{ENTRY}") if self._is_owned(file.parent.name, owner)]
        files.sort(key=lambda file: -(file.parent / OWNER).stat().st_mtime)
        return [self._read(file) for file in files]

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
        if not ID.fullmatch(number) or not self._is_owned(number, owner):
            raise InputError(f"there is no take {number[:40]!r}; choose one from the list")
        return self._folder / number

    def write(self, entry: TakeEntry) -> None:
        """Write a take's state, unless it was deleted."""
        if (self._folder / entry.id).is_dir():
            write_atomically(self._folder / entry.id / ENTRY, json.dumps(asdict(entry), ensure_ascii=False).encode())

    def remove(self, owner: str, number: str) -> None:
        """Delete a take with all that was made of it; errors as `folder`."""
        folder = self.folder(owner, number)
        with translate_disk_errors(folder):
            shutil.rmtree(folder)

    def rename(self, owner: str, number: str, name: str) -> None:
        """Give a take another name; errors as `folder`."""
        name = " ".join(name.split())
        if not 0 < len(name) <= MAX_NAME:
            raise InputError(f"the name must have 1 to {MAX_NAME} characters; write another one")
        self.write(replace(self.entry(owner, number), name=name))

    def end_readings(self) -> None:
        """Mark takes whose reading a stop of the server ended as failed, and delete their videos."""
        for file in self._folder.glob(f"*/{ENTRY}"):
            entry = self._read(file)
            if entry.state == READING:
                for video in file.parent.glob(f"{VIDEO}.*"):
                    video.unlink()
                message = "the server stopped while it was read; record or upload it again"
                self.write(replace(entry, state=FAILED, message=message))

    def _is_owned(self, number: str, owner: str) -> bool:
        try:
            return (self._folder / number / OWNER).read_text(encoding="utf-8") == owner
        except OSError:
            return False

    @staticmethod
    def _read(file: Path) -> TakeEntry:
        try:
            content: dict[str, Any] = read_json(file)
            return TakeEntry(**content)
        except (OSError, DataError, TypeError):
            return TakeEntry(file.parent.name, "damaged take", FAILED, message="its file is damaged; delete it")
