"""Folders of the studio that belong to one key each: projects, recordings, takes.

Each has a random name, a file ``owner`` with the name of the key, and a file that lists it. All methods block.
"""

import re
import secrets
import shutil
from pathlib import Path

from lexicon.errors import InputError
from tts2face.storage.files import translate_disk_errors

ID = re.compile(r"[0-9a-f]{16}")
OWNER = "owner"


class OwnedFolders:
    """Folders in a folder, which is made at its first use.

    Parameters
    ----------
    entry
        Name of the file without which a folder is not complete, and not listed.
    noun
        What a folder is, for messages.
    """

    def __init__(self, folder: Path, entry: str, noun: str) -> None:
        self._folder = folder
        self._entry = entry
        self._noun = noun

    def make(self, owner: str, *parts: str) -> Path:
        """A new folder of an owner, with folders in it."""
        folder = self._folder / secrets.token_hex(8)
        with translate_disk_errors(folder):
            folder.mkdir(parents=True)
            for part in parts:
                (folder / part).mkdir()
            (folder / OWNER).write_text(owner, encoding="utf-8")
        return folder

    def of(self, owner: str | None = None) -> list[Path]:
        """Complete folders of an owner, or of all, those changed last first."""
        files = [
            file
            for file in self._folder.glob(f"*/{self._entry}")
            if ID.fullmatch(file.parent.name) and owner in {None, _owner(file.parent)}
        ]
        return [file.parent for file in sorted(files, key=lambda file: -file.stat().st_mtime)]

    def at(self, number: str) -> Path:
        """Path of a folder by its name, whoever owns it."""
        return self._folder / number

    def find(self, number: str, owner: str) -> Path:
        """A complete folder of an owner.

        Raises
        ------
        InputError
            The owner has no such one.
        """
        folder = self._folder / number
        # one answer for all: another key learns of no folder
        if not ID.fullmatch(number) or _owner(folder) != owner or not (folder / self._entry).is_file():
            raise InputError(f"there is no {self._noun} {number[:40]!r}; choose one from the list")
        return folder

    def remove(self, number: str) -> None:
        """Remove a folder with everything in it; no half of one is ever listed."""
        gone = self._folder / f".{number}"
        with translate_disk_errors(gone):
            self.at(number).rename(gone)
            shutil.rmtree(gone)


def _owner(folder: Path) -> str | None:
    try:
        return (folder / OWNER).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        return None
