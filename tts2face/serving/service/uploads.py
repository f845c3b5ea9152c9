"""Uploaded files: never opened by the server itself, never stored under a client's name.

Turns of the uploads that are checked.
"""

import asyncio
import errno
import json
import os
import tempfile
from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from starlette.datastructures import UploadFile

from lexicon.errors import DataError, InputError
from lexicon.inputs import parse_json
from tts2face.processes.async_parent import call_once
from tts2face.processes.parent import ChildEndedError
from tts2face.processes.tools import run_take_tool
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.exchange import while_client_stays
from tts2face.serving.service.settings import ServiceSettings
from tts2face.serving.work import resource_check
from tts2face.serving.work.resource_check import STATEMENT
from tts2face.serving.work.uploaded_file import DECODE, PICTURE, PLACES, SOUND, SUBTITLES, VIDEO, program

MAX_CHECKS, MAX_WAITING = 2, 8  # uploads that are checked, and that wait for it


class Checks:
    """Turns of the uploads that are checked."""

    def __init__(self) -> None:
        self._turns, self._n_waiting = asyncio.Semaphore(MAX_CHECKS), 0

    async def __aenter__(self) -> None:
        """Wait for a turn.

        Raises
        ------
        RefusedError
            Too many wait already.
        """
        if self._turns.locked() and self._n_waiting >= MAX_WAITING:
            raise RefusedError(
                429, "busy", f"{self._n_waiting} uploads wait to be checked; send it again later", {"Retry-After": "10"}
            )
        self._n_waiting += 1
        try:
            with while_client_stays():
                await self._turns.acquire()
        finally:
            self._n_waiting -= 1

    async def __aexit__(self, *_: object) -> None:
        """End the turn."""
        self._turns.release()


RESOURCE_TIMEOUT_S = 300.0  # a check takes 3 to 7 s; with other work on the machine, and kernels to compile, longer
AVATAR_CPU_S = 240  # the head of a person takes 15 s
UPLOAD_PREFIX = "tts2face-upload-"  # of names of private folders
MAX_REASON = 300  # characters
TOO_MUCH = "it needs too much memory or time"
MAX_TEXT_BYTES = 1_000_000
BLOCK_BYTES = 1 << 20


@dataclass(frozen=True, slots=True)
class UploadFolder:
    """A private folder of one request; it is removed when the request ends."""

    path: Path
    settings: ServiceSettings

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

    async def text(self, name: str, upload: UploadFile, suffix: str) -> Path:
        """Text of an upload, at most `MAX_TEXT_BYTES`; its reader checks it."""
        path = self.path / f"{name}{suffix}"
        content = await upload.read(MAX_TEXT_BYTES + 1)
        if len(content) > MAX_TEXT_BYTES:
            raise RefusedError(413, "too_large", f"{name} has more than {MAX_TEXT_BYTES} bytes; send less")
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
        path = await self._decode(f"{SUBTITLES}{encoding or ''}", name, upload, suffix, max_cues)
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
        await decode_file((VIDEO, given, checked, self.settings.video_s), name, self.settings.decode_s)
        facts = parse_json(checked.read_text(), name)
        return given.rename(given.with_suffix(facts["suffix"])), float(facts["seconds"])

    async def resource(self, kind: str, given: Path, max_bytes: float) -> Path:
        """Folder with a saved file, checked as a talker, face, palette or dictionary (`tts2face.serving.work`).

        A photo, beside which is what is `stated` of it, becomes a face.

        Raises
        ------
        RefusedError
            It is none, or larger than `max_bytes`.
        """
        checked = self.path / "checked"
        checked.mkdir()
        await decode_file((kind, given, checked, max_bytes), f"the {kind}", RESOURCE_TIMEOUT_S)
        return checked

    async def avatar(self, photo: Path, max_bytes: float) -> Path:
        """Folder with the checked head of a person in a photo, beside which is its statement; errors as `resource`."""
        checked = self.path / "checked"
        checked.mkdir()
        order = {"take": str(photo), "out": str(checked), "max_bytes": max_bytes}
        try:
            async with asyncio.timeout(RESOURCE_TIMEOUT_S):
                await run_take_tool("avatar", order, lambda **_: None, cpu_s=AVATAR_CPU_S)
        except (InputError, DataError) as wrong:
            raise _refused("the photo", str(wrong).replace(photo.name, "the photo")) from wrong
        except (ChildEndedError, TimeoutError) as ended:
            raise _refused("the photo", TOO_MUCH) from ended
        return checked

    async def places(self, photo: Path) -> tuple[Path, dict[str, Any]]:
        """The picture of a saved photo as a browser shows it, and what was found in it: size, fit and notes.

        Raises
        ------
        RefusedError
            It shows no face that can be moved.
        """
        await decode_file((PLACES, photo, self.path, 0.0), "the photo", RESOURCE_TIMEOUT_S)
        found: dict[str, Any] = parse_json((self.path / resource_check.PLACES).read_text(), "the photo")
        return self.path / resource_check.SHOWN, found

    def state(self, photo: Path, stated: Mapping[str, Any]) -> None:
        """Write what is stated of a photo beside it, with the most pixels that it may have."""
        photo.with_name(STATEMENT).write_text(json.dumps({**stated, "max_pixels": self.settings.upload_pixels}))

    async def _decode(self, kind: str, name: str, upload: UploadFile, suffix: str, limit: float) -> Path:
        given, decoded = await self._save(name, upload), self.path / f"{name}{suffix}"
        await decode_file((kind, given, decoded, limit), name, self.settings.decode_s)
        given.unlink(missing_ok=True)
        return decoded

    async def _save(self, name: str, upload: UploadFile) -> Path:
        path = self.path / f"{name}.upload"
        await save_upload(upload, path)
        return path


async def save_upload(upload: UploadFile, path: Path) -> None:
    """Write an uploaded file to a path."""
    with path.open("wb") as file:
        while block := await upload.read(BLOCK_BYTES):
            file.write(block)


async def decode_file(arguments: tuple[str, Path, Path, float], name: str, timeout_s: float) -> None:
    """Decode a file (kind, source, target and limit of `uploaded_file.decode`); `name` is that in messages.

    Raises
    ------
    RefusedError
        The file is refused, or takes too much memory or time.
    BackendError
        A model or package that its check needs is missing on this machine.
    OSError
        The disk is full.
    """
    kind, source, target, limit = arguments
    order = {"kind": kind, "source": str(source), "target": str(target), "limit": limit}
    try:
        answer = await call_once(program(kind), DECODE, order, timeout_s=timeout_s)
    except TimeoutError as late:
        raise RefusedError(
            422, "invalid_data", f"{name} took more than {timeout_s:g} s to decode; send a simpler file"
        ) from late
    except (InputError, DataError) as refused:
        raise _refused(name, str(refused)) from refused
    except ChildEndedError as ended:
        raise _refused(name, TOO_MUCH) from ended
    if answer["is_full"]:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def _refused(name: str, reason: str) -> RefusedError:
    return RefusedError(422, "invalid_data", f"{name} cannot be used: {reason[:MAX_REASON]}; send another file")


@asynccontextmanager
async def upload_folder(settings: ServiceSettings) -> AsyncIterator[UploadFolder]:
    """A private folder for the uploads of one request."""
    with tempfile.TemporaryDirectory(prefix=UPLOAD_PREFIX) as folder:
        yield UploadFolder(Path(folder), settings)
