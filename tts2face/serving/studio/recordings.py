"""Recordings of the studio on disk: prompts, takes and the talker that is built of them, each in a folder of its own.

``recordings/ID/recordings`` holds the accepted takes with their transcripts, as `tts2face corpus build` reads them;
``unchecked`` and ``refused`` the others; ``prompts.json`` what is to be read, ``manifest.json`` the state of each take;
`owned_folders` says whose it is. A crash leaves whole files only. All methods of the store block.
"""

import json
import os
import secrets
import threading
from collections.abc import AsyncIterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from lexicon.errors import DataError, InputError
from lexicon.values.json_text import read_json
from tts2face.serving.studio.owned_folders import OwnedFolders, _owner
from tts2face.storage.files import translate_disk_errors, write_atomically

SUFFIXES = {"video/webm": ".webm", "video/mp4": ".mp4"}  # as MediaRecorder writes them
PROMPTS = "prompts.json"
MANIFEST = "manifest.json"
CACHE = "cache"
ACCEPTED_FOLDER = "recordings"
UNCHECKED_FOLDER = "unchecked"
REFUSED_FOLDER = "refused"
# states of a take
CHECKING = "checking"
GOOD = "good"
WEAK = "weak"
REFUSED = "refused"
FOLDERS = {
    CHECKING: UNCHECKED_FOLDER, GOOD: ACCEPTED_FOLDER, WEAK: ACCEPTED_FOLDER, REFUSED: REFUSED_FOLDER,
}  # fmt: skip
MAX_TAKE_BYTES = 64 << 20
MAX_NAME_CHARACTERS = 60
ENGLISH = "en"  # language of the transcripts that `tts2face corpus build` pronounces


def judge(findings: Sequence[Mapping[str, Any]]) -> tuple[str, str]:
    """State of a take by the findings of its check, the gravest first; what to do better, in one sentence."""
    if not findings:
        return GOOD, ""
    return REFUSED if findings[0]["severity"] == "refusal" else WEAK, str(findings[0]["message"])


async def receive_take(parts: AsyncIterator[bytes], target: Path) -> None:
    """Write an uploaded take to a file."""
    n_bytes = 0
    with target.open("xb") as file:
        async for part in parts:
            n_bytes += file.write(part)
            if n_bytes > MAX_TAKE_BYTES:
                raise InputError(f"a take may have {MAX_TAKE_BYTES >> 20} MB; record it shorter")
        file.flush()
        # a person has spoken it: it must survive a loss of power
        os.fsync(file.fileno())
    if not n_bytes:
        raise InputError("the take is empty; record it again")


@dataclass(frozen=True, slots=True)
class PromptTake:
    """A recorded prompt: its file, one of the states, what to do better, and the beginning of names in the cache."""

    file: str
    state: str
    advice: str = ""
    key: str = ""


@dataclass(frozen=True, slots=True)
class RecordingEntry:
    """A recording in a list, with the number of accepted takes and of prompts."""

    id: str
    name: str
    n_accepted: int
    n_prompts: int
    changed: float


class RecordingStore:
    """Recordings of all owners in a folder, which is made at its first use."""

    def __init__(self, folder: Path) -> None:
        self._recordings = OwnedFolders(folder / "recordings", MANIFEST, "recording")
        self._lock = threading.Lock()  # of the manifests
        self.revision = 0  # increased with every change

    def create(self, owner: str, name: str, prompts: Mapping[str, Any]) -> str:
        """Id of a new recording; `prompts` as the tool ``recordings`` gives them.

        Raises
        ------
        InputError
            The name is empty or too long.
        """
        if not name.strip() or len(name) > MAX_NAME_CHARACTERS:
            raise InputError(f"the name must have 1 to {MAX_NAME_CHARACTERS} characters; write a name")
        folder = self._recordings.make(owner, *set(FOLDERS.values()))
        write_atomically(folder / PROMPTS, json.dumps(prompts, ensure_ascii=False).encode())
        self._write(folder.name, {"name": name.strip(), "takes": {}})
        return folder.name

    def entries(self, owner: str) -> list[RecordingEntry]:
        """Recordings of an owner, those changed last first."""
        return [self._entry(folder) for folder in self._recordings.of(owner)]

    def folder(self, number: str, owner: str) -> Path:
        """Folder of a recording.

        Raises
        ------
        InputError
            The owner has no such recording.
        """
        return self._recordings.find(number, owner)

    def at(self, number: str) -> Path:
        """Path of the folder of a recording, whoever owns it."""
        return self._recordings.at(number)

    def owner(self, number: str) -> str:
        """Owner of a recording; empty if it is deleted."""
        return _owner(self.at(number)) or ""

    def name(self, number: str) -> str:
        """Name of a recording."""
        return str(self._read(number)["name"])

    def prompts(self, number: str) -> dict[str, Any]:
        """Prompts of a recording with their units, and the counts of running text."""
        return dict(self._read_json(number, PROMPTS))

    def takes(self, number: str) -> dict[int, PromptTake]:
        """The take of each recorded prompt, by its index."""
        return {int(at): PromptTake(**take) for at, take in sorted(self._read(number)["takes"].items())}

    def add_take(self, number: str, at: int, content: Path, media_type: str) -> PromptTake:
        """Take of a prompt, which replaces an earlier one; the file `content` is moved."""
        prompts = self.prompts(number)["prompts"]
        if not 0 <= at < len(prompts):
            raise InputError(f"there is no prompt {at + 1}; there are {len(prompts)}")
        suffix = SUFFIXES.get(media_type.partition(";")[0].strip().lower())
        if suffix is None:
            raise InputError(f"a take must be {' or '.join(SUFFIXES)}, not {media_type[:40]!r}; use another browser")
        take = PromptTake(f"take-{at + 1:04d}-{secrets.token_hex(3)}{suffix}", CHECKING)
        with self._lock, translate_disk_errors(content):
            manifest = self._read(number)
            os.replace(content, self.at(number) / UNCHECKED_FOLDER / take.file)
            earlier = manifest["takes"].get(str(at))
            manifest["takes"][str(at)] = asdict(take)
            self._write(number, manifest)
            if earlier is not None:
                self._remove_files(number, PromptTake(**earlier))
        return take

    def judge(self, number: str, at: int, judged: PromptTake) -> None:
        """Set the state of a take after its check; if it was recorded again or deleted meanwhile, forget it."""
        folder = self.at(number)
        with self._lock:
            if not folder.is_dir():
                return
            manifest = self._read(number)
            current = manifest["takes"].get(str(at), {})
            # recorded again, or deleted meanwhile
            if current.get("file") != judged.file:
                self._remove_files(number, judged)
                return
            target = folder / FOLDERS[judged.state] / judged.file
            with translate_disk_errors(target):
                text = self.transcript(number, at)
                if text is not None:
                    target.with_suffix(".txt").write_text(text, encoding="utf-8")
                os.replace(folder / FOLDERS[current["state"]] / judged.file, target)
            manifest["takes"][str(at)] = asdict(judged)
            self._write(number, manifest)

    def delete_take(self, number: str, at: int) -> None:
        """Delete the take of a prompt and its files; without one, do nothing."""
        with self._lock:
            manifest = self._read(number)
            take = manifest["takes"].pop(str(at), None)
            if take is not None:
                self._write(number, manifest)
                self._remove_files(number, PromptTake(**take))

    def delete(self, number: str) -> None:
        """Delete a recording with all that was made of it."""
        with self._lock:
            self._recordings.remove(number)

    def path(self, number: str, take: PromptTake) -> Path:
        """File of a take."""
        return self.at(number) / FOLDERS[take.state] / take.file

    def unchecked(self) -> Sequence[tuple[str, int, PromptTake]]:
        """Takes whose check did not end, of all recordings: id, index of the prompt, take."""
        return [
            (folder.name, at, take)
            for folder in self._recordings.of()
            for at, take in self.takes(folder.name).items()
            if take.state == CHECKING
        ]

    def transcript(self, number: str, at: int) -> str | None:
        """Words of a take, in English; None in other languages, whose phones are recognised."""
        prompts = self.prompts(number)
        is_english = str(prompts.get("language", ENGLISH)).partition("-")[0] == ENGLISH
        return str(prompts["prompts"][at]["text"]) if is_english else None

    def _remove_files(self, number: str, take: PromptTake) -> None:
        """Remove a take, its transcript, and what its check cached."""
        for folder in set(FOLDERS.values()):
            file = self.at(number) / folder / take.file
            file.unlink(missing_ok=True)
            file.with_suffix(".txt").unlink(missing_ok=True)
        if take.key:
            for file in (self.at(number) / CACHE).glob(f"{take.key}-*"):
                file.unlink(missing_ok=True)

    def _entry(self, folder: Path) -> RecordingEntry:
        manifest, number = folder / MANIFEST, folder.name
        n_accepted = sum(FOLDERS[take.state] == ACCEPTED_FOLDER for take in self.takes(number).values())
        n_prompts = len(self.prompts(number)["prompts"])
        return RecordingEntry(number, self.name(number), n_accepted, n_prompts, manifest.stat().st_mtime)

    def _read(self, number: str) -> dict[str, Any]:
        return dict(self._read_json(number, MANIFEST))

    def _read_json(self, number: str, name: str) -> Any:
        path = self.at(number) / name
        try:
            return read_json(path)
        except OSError as refused:
            raise DataError(f"{path} cannot be read ({refused.strerror}); delete the recording") from refused

    def _write(self, number: str, manifest: Mapping[str, Any]) -> None:
        self.revision += 1
        write_atomically(self.at(number) / MANIFEST, json.dumps(manifest, ensure_ascii=False).encode())
