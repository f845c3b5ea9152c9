"""Pictures of the shipped talkers, faces and palettes, drawn once and kept in the data folder."""

import asyncio
from pathlib import Path

from tts2face.batch.address import file_hash
from tts2face.service.uploads.decode import DRAW
from tts2face.service.uploads.upload_folder import RESOURCE_TIMEOUT_S, decode_file
from tts2face.storage.files import find_file, translate_disk_errors
from tts2face.storage.temporary import Temporary

PICTURE_FORMAT = 1  # increased when the same file gives another picture
_drawing = asyncio.Lock()  # one at a time


async def shipped_picture(data: Path, kind: str, name: str) -> Path:
    """Path of the picture of a shipped model; drawn in a child process if it is not there yet."""
    source = find_file(name, kind)
    digest = await asyncio.to_thread(file_hash, source)
    path = data / "pictures" / f"{kind}-{PICTURE_FORMAT}-{digest}.png"
    async with _drawing:
        if not path.exists():
            with translate_disk_errors(path):
                path.parent.mkdir(parents=True, exist_ok=True)
                with Temporary(path) as temporary:
                    await decode_file((f"{DRAW}{kind}", source, temporary.path, 0.0), name, RESOURCE_TIMEOUT_S)
                    temporary.replace(path)
    return path
