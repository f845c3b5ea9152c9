"""Pictures of the shipped talkers, faces and palettes, drawn once and kept in the data folder."""

import asyncio
from pathlib import Path

from tts2face.serving.batch.content_address import file_hash
from tts2face.serving.service.decoders import Decoders
from tts2face.serving.service.uploads import RESOURCE_TIMEOUT_S
from tts2face.serving.work.uploaded_file import DRAW, FileOrder
from tts2face.storage.files import translate_disk_errors
from tts2face.storage.shipped import find_file
from tts2face.storage.temporary import Temporary

PICTURE_FORMAT = 2  # increased when the same file gives another picture
_drawing = asyncio.Lock()  # one at a time


async def shipped_picture(decoders: Decoders, data: Path, kind: str, name: str) -> Path:
    """Path of the picture of a shipped model; drawn in a child process if it is not there yet."""
    source = find_file(name, kind)
    digest = await asyncio.to_thread(file_hash, source)
    path = data / "pictures" / f"{kind}-{PICTURE_FORMAT}-{digest}.png"
    async with _drawing:
        if not path.exists():
            with translate_disk_errors(path):
                path.parent.mkdir(parents=True, exist_ok=True)
                with Temporary(path) as temporary:
                    order = FileOrder(f"{DRAW}{kind}", source, temporary.path, 0.0)
                    await decoders.decode("", order, name, RESOURCE_TIMEOUT_S)
                    temporary.replace(path)
    return path
