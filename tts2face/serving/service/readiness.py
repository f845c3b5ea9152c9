"""What the service needs in order to serve, and what of it is missing now."""

import asyncio
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING

from tts2face.serving.batch.engine import MIN_FREE_BYTES, free_bytes

if TYPE_CHECKING:
    from tts2face.serving.service.state import ServiceState

LOOK_S = 1.0  # for which what was found is repeated, however often anybody asks
MB = 1 << 20


def lack_of_room(folder: Path, noun: str) -> str:
    """Why work on the disk of a folder pauses; empty where it does not."""
    try:
        free = free_bytes(folder)
    except OSError as refused:
        return f"the {noun} cannot be read ({refused.strerror}); check its place and its rights"
    if free >= MIN_FREE_BYTES:
        return ""
    return f"the disk of the {noun} has {free // MB} MB free, and work needs {MIN_FREE_BYTES // MB}; free some space"


def lack_of_folder(folder: Path, noun: str) -> str:
    """Why a folder cannot serve, which is found out by writing a file; empty if it can."""
    try:
        with tempfile.TemporaryFile(dir=folder) as file:
            file.write(b"0")
    except OSError as refused:
        return f"the {noun} cannot be written ({refused.strerror}); check its place, its rights and its disk"
    return lack_of_room(folder, noun)


class Readiness:
    """Looks at processes, folders, database and workers; at most one look in `LOOK_S`."""

    def __init__(self, state: "ServiceState") -> None:
        self._state, self._looking = state, asyncio.Lock()
        self._found: dict[str, str] = {}
        self._at = -LOOK_S

    async def look(self) -> dict[str, str]:
        """What the service needs, by name, with the reason where it is missing and an empty text where it is there."""
        async with self._looking:
            if time.monotonic() >= self._at + LOOK_S:
                self._found, self._at = await self._look(), time.monotonic()
        draining = "the service is shutting down; ask another server" if self._state.is_draining else ""
        return self._found | {"accepting": draining}

    async def _look(self) -> dict[str, str]:
        pool, jobs, settings = self._state.pool, self._state.jobs, self._state.settings
        is_reachable = await jobs.is_reachable()
        workers = jobs.n_workers > 0 or not settings.workers
        return {
            "models": "" if pool.n_ready else "no synthesis process has loaded its models yet; wait, or see the log",
            "data": await asyncio.to_thread(lack_of_folder, settings.data_folder, "data folder"),
            "temporary": await asyncio.to_thread(lack_of_folder, Path(tempfile.gettempdir()), "temporary folder"),
            "database": "" if is_reachable else "the database of the jobs does not answer; check it",
            "workers": "" if workers else f"none of {settings.workers} job workers is alive; see the log",
        }
