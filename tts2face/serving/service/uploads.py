"""Uploaded files: never opened by the server itself, never stored under a client's name."""

import json
import shutil
import tempfile
from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from starlette.concurrency import run_in_threadpool
from starlette.datastructures import UploadFile

from lexicon.values.json_text import parse_json
from tts2face.serving.service.decoders import Decoders
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.settings import ServiceSettings
from tts2face.serving.work import resource_check
from tts2face.serving.work.resource_check import STATEMENT
from tts2face.serving.work.uploaded_file import PICTURE, PLACES, SOUND, SUBTITLES, VIDEO, FileOrder

RESOURCE_TIMEOUT_S = 300.0  # a check takes 3 to 7 s; with other work on the machine, and kernels to compile, longer
UPLOAD_PREFIX = "tts2face-upload-"  # of names of private folders
# of transcripts, subtitles and tables
MAX_TEXT_BYTES = 1_000_000
MAX_TRANSCRIPT_BYTES = 4_000_000  # half an hour of speech with the times of its phones is 2.8 MB
# read at a time
BLOCK_BYTES = 1 << 20


@dataclass(frozen=True, slots=True)
class UploadFolder:
    """A private folder of one request of a key; it is removed when the request ends.

    `notes` say what is guessed of its sounds.
    """

    path: Path
    settings: ServiceSettings
    decoders: Decoders
    key: str
    notes: list[str] = field(default_factory=list)

    async def sound(self, name: str, upload: UploadFile) -> Path:
        """Decoded sound of an upload, a .wav file; `name` is the field's name in messages.

        Raises
        ------
        RefusedError
            It is no sound, or too long.
        """
        return await self._decode(SOUND, name, upload, ".wav", self.settings.sound_s)

    async def picture(self, name: str, upload: UploadFile) -> Path:
        """Decoded picture of an upload, a .png file; errors as `sound`."""
        return await self._decode(PICTURE, name, upload, ".png", self.settings.upload_pixels)

    async def text(self, name: str, upload: UploadFile, suffix: str, max_bytes: int = MAX_TEXT_BYTES) -> Path:
        """Text of an upload, at most `max_bytes`; its reader checks it."""
        path = self.path / f"{name}{suffix}"
        content = await upload.read(max_bytes + 1)
        if len(content) > max_bytes:
            raise RefusedError(413, "too_large", f"{name} has more than {max_bytes} bytes; send less")
        path.write_bytes(content)
        return path

    async def subtitles(
        self, name: str, upload: UploadFile, suffix: str, encoding: str | None, max_cues: int
    ) -> tuple[Path, dict[str, float]]:
        """Checked subtitles of an upload, and their numbers: cues and seconds.

        Raises
        ------
        RefusedError
            They have no cues, or too many.
        """
        given, path = await self._save(name, upload), self.path / f"{name}{suffix}"
        await self._check(FileOrder(SUBTITLES, given, path, max_cues, encoding), name, self.settings.decode_s)
        numbers: dict[str, float] = parse_json(Path(f"{path}.json").read_text(), name)
        return path, numbers

    async def video(self, name: str, upload: UploadFile) -> tuple[Path, float]:
        """Recording of a talker, as it was sent, and its seconds.

        Raises
        ------
        RefusedError
            It is no video, too long, or its pictures are too large.
        """
        given, checked = await self._save(name, upload), self.path / f"{name}.video"
        await self._check(FileOrder(VIDEO, given, checked, self.settings.video_s), name, self.settings.decode_s)
        facts = parse_json(checked.read_text(), name)
        return given.rename(given.with_suffix(facts["suffix"])), float(facts["seconds"])

    async def resource(self, kind: str, given: Path, max_bytes: float) -> Path:
        """Folder with a saved file, checked as a talker, face, palette or dictionary (`tts2face.serving.work`).

        A photo, beside which is what is `stated` of it, becomes a face.
        """
        checked = self.path / "checked"
        checked.mkdir()
        await self._check(FileOrder(kind, given, checked, max_bytes), f"the {kind}", RESOURCE_TIMEOUT_S)
        return checked

    async def avatar(self, photo: Path, max_bytes: float) -> Path:
        """Folder with the checked head of a person in a photo, beside which is its statement; errors as `resource`."""
        checked = self.path / "checked"
        checked.mkdir()
        order = {"take": str(photo), "out": str(checked), "max_bytes": max_bytes}
        await self.decoders.make_avatar(self.key, order)
        return checked

    async def places(self, photo: Path) -> tuple[Path, dict[str, Any]]:
        """The picture of a saved photo as a browser shows it, and what was found in it: size, fit and notes.

        Raises
        ------
        RefusedError
            It shows no face that can be moved.
        """
        await self._check(FileOrder(PLACES, photo, self.path, 0.0), "the photo", RESOURCE_TIMEOUT_S)
        found: dict[str, Any] = parse_json((self.path / resource_check.PLACES).read_text(), "the photo")
        return self.path / resource_check.SHOWN, found

    def state(self, photo: Path, stated: Mapping[str, Any]) -> None:
        """Write what is stated of a photo beside it, with the most pixels that it may have."""
        photo.with_name(STATEMENT).write_text(json.dumps({**stated, "max_pixels": self.settings.upload_pixels}))

    async def _decode(self, kind: str, name: str, upload: UploadFile, suffix: str, limit: float) -> Path:
        given, decoded = await self._save(name, upload), self.path / f"{name}{suffix}"
        await self._check(FileOrder(kind, given, decoded, limit), name, self.settings.decode_s)
        given.unlink(missing_ok=True)
        return decoded

    async def _check(self, order: FileOrder, name: str, timeout_s: float) -> None:
        self.notes.extend(await self.decoders.decode(self.key, order, name, timeout_s))

    async def _save(self, name: str, upload: UploadFile) -> Path:
        path = self.path / f"{name}.upload"
        await save_upload(upload, path)
        return path


async def save_upload(upload: UploadFile, path: Path) -> None:
    """Write an uploaded file to a path, in a thread."""

    def copy() -> None:
        with path.open("wb") as file:
            shutil.copyfileobj(upload.file, file, BLOCK_BYTES)

    await run_in_threadpool(copy)


@asynccontextmanager
async def upload_folder(settings: ServiceSettings, decoders: Decoders, key: str) -> AsyncIterator[UploadFolder]:
    """A private folder for the uploads of one request of a key."""
    with tempfile.TemporaryDirectory(prefix=UPLOAD_PREFIX) as folder:
        yield UploadFolder(Path(folder), settings, decoders, key)
