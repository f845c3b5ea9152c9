"""Uploaded files: never opened by the server itself, never stored under a client's name."""

import asyncio
import sys
import tempfile
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from starlette.datastructures import UploadFile

from tts2face.service.decode_process import PICTURE, REFUSED, SOUND
from tts2face.service.errors import RefusedError
from tts2face.service.settings import ServiceSettings

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

    async def _decode(self, kind: str, name: str, upload: UploadFile, suffix: str, limit: float) -> Path:
        given, decoded = self.path / f"{name}.upload", self.path / f"{name}{suffix}"
        with given.open("wb") as file:
            while block := await upload.read(BLOCK_BYTES):
                file.write(block)
        child = await asyncio.create_subprocess_exec(
            sys.executable, "-m", "tts2face.service.decode_process", kind, str(given), str(decoded), str(limit),
            stdin=asyncio.subprocess.DEVNULL, stdout=asyncio.subprocess.DEVNULL, stderr=asyncio.subprocess.PIPE,
            cwd=self.path,
        )  # fmt: skip
        try:
            _, written = await asyncio.wait_for(child.communicate(), self.settings.decode_s)
        except TimeoutError as late:
            raise RefusedError(
                422,
                "invalid_data",
                f"{name} took more than {self.settings.decode_s:g} s to decode; send a simpler file",
            ) from late
        finally:
            if child.returncode is None:
                with suppress(ProcessLookupError):
                    child.kill()
                await child.wait()
            given.unlink(missing_ok=True)
        if child.returncode == 0:
            return decoded
        reason = written.decode(errors="replace") if child.returncode == REFUSED else "it needs too much memory or time"
        raise RefusedError(422, "invalid_data", f"{name} cannot be used: {reason[:200]}; send another file")


@asynccontextmanager
async def upload_folder(settings: ServiceSettings) -> AsyncIterator[UploadFolder]:
    """A private folder for the uploads of one request."""
    with tempfile.TemporaryDirectory(prefix="tts2face-upload-") as folder:
        yield UploadFolder(Path(folder), settings)
