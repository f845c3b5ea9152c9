"""A table of marks of a person's own, which a project keeps among its files."""

import asyncio
import hashlib
import tempfile
from pathlib import Path

from lexicon.errors import InputError
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.studio.studio_host import StudioHost
from tts2face.serving.studio.workspace import Workspace
from tts2face.serving.work.resource_check import CONTENT, TEXT_MARKS
from tts2face.serving.work.uploaded_file import FileOrder

MAX_TABLE_BYTES = 1_000_000


async def add_mark_table(studio: StudioHost, workspace: Workspace, path: Path) -> Path:
    """Path of the checked table among the files of a project, named by its content; an `InputError` if it is none."""
    if path.stat().st_size > MAX_TABLE_BYTES:
        raise InputError(f"the table has more than {MAX_TABLE_BYTES} bytes; remove rows")
    state = studio.state
    with tempfile.TemporaryDirectory(prefix="tts2face-upload-") as folder:
        order = FileOrder(TEXT_MARKS, path, Path(folder), float(MAX_TABLE_BYTES))
        try:
            await state.decoders.decode(workspace.key.name, order, "the table", state.settings.decode_s)
        except RefusedError as refused:
            raise InputError(refused.message) from refused
        table = Path(folder, CONTENT)
        name = f"marks-{hashlib.sha256(table.read_bytes()).hexdigest()[:16]}.tsv"
        return await asyncio.to_thread(studio.store.add_asset, workspace.id, name, table)
