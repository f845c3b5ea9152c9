"""What the service needs in order to serve, and what of it is missing now."""

import asyncio
import tempfile
import time
from pathlib import Path

from tts2face.serving.batch.engine import lack_of_folder
from tts2face.serving.service.job_service import JobService
from tts2face.serving.service.pool import Pool
from tts2face.serving.service.settings import ServiceSettings

LOOK_S = 1.0  # for which what was found is repeated, however often anybody asks


class Readiness:
    """Looks at processes, folders, database and workers; at most one look in `LOOK_S`."""

    def __init__(self, pool: Pool, jobs: JobService, settings: ServiceSettings) -> None:
        self._pool, self._jobs, self._settings = pool, jobs, settings
        self._looking = asyncio.Lock()
        self._found: dict[str, str] = {}
        self._at = -LOOK_S

    async def look(self) -> dict[str, str]:
        """What the service needs, by name, with the reason where it is missing and an empty text where it is there."""
        async with self._looking:
            if time.monotonic() >= self._at + LOOK_S:
                self._found, self._at = await self._look(), time.monotonic()
        return dict(self._found)

    async def _look(self) -> dict[str, str]:
        pool, jobs, settings = self._pool, self._jobs, self._settings
        is_reachable = await jobs.is_reachable()
        workers = jobs.n_workers > 0 or not settings.workers
        return {
            "models": "" if pool.n_ready else f"{pool.preparation}; wait, or see the log",
            "data": await asyncio.to_thread(lack_of_folder, settings.data_folder, "data folder"),
            "temporary": await asyncio.to_thread(lack_of_folder, Path(tempfile.gettempdir()), "temporary folder"),
            "database": "" if is_reachable else "the database of the jobs does not answer; check it",
            "workers": "" if workers else f"none of {settings.workers} job workers is alive; see the log",
        }
