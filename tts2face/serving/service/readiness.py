"""Parts that the service needs in order to serve, and those that are missing now."""

import asyncio
import logging
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path

from tts2face.serving.batch.engine import lack_of_folder
from tts2face.serving.service.exchange import in_background
from tts2face.serving.service.job_service import JobService
from tts2face.serving.service.logs import log_event
from tts2face.serving.service.pool import Pool
from tts2face.serving.service.settings import ServiceSettings

CHECK_S = 1.0  # for which what was found is repeated, however often anybody asks
DATABASE_S = 0.3  # for which a check waits for it; Kubernetes' probes wait for 1 s
FOR_STREAMS = ("models", "data", "temporary")
CHECKS = (*FOR_STREAMS, "database", "workers")


class Readiness:
    """Checks of processes, folders, database and workers; at most one in `CHECK_S`."""

    def __init__(self, pool: Pool, jobs: JobService, settings: ServiceSettings) -> None:
        self._pool, self._jobs = pool, jobs
        self._settings = settings
        self._checking = asyncio.Lock()
        self._asking: asyncio.Task[bool] | None = None  # the database
        self._found: dict[str, str] = {}
        self._at = -CHECK_S

    async def check(self) -> dict[str, str]:
        """Each of `CHECKS`, with the reason where it is missing and an empty text where it is there.

        Streams need those of `FOR_STREAMS`, jobs all. A change is written to the log.
        """
        async with self._checking:
            if time.monotonic() >= self._at + CHECK_S:
                before, self._found = self._found, await self._check()
                self._at = time.monotonic()
                if _missing(before) != _missing(self._found) or not before:
                    # only changes are logged: probes ask every few seconds
                    level = logging.WARNING if any(self._found.values()) else logging.INFO
                    log_event(
                        "readiness", level=level, missing={name: self._found[name] for name in _missing(self._found)}
                    )
        return dict(self._found)

    async def _check(self) -> dict[str, str]:
        pool, settings = self._pool, self._settings
        is_reachable = await self._is_reachable()
        preparing = pool.preparation.lack or f"{pool.preparation}; wait, or see the log"
        workers = self._jobs.n_workers > 0 or not settings.workers
        return {
            "models": "" if pool.n_ready else preparing,
            "data": await asyncio.to_thread(lack_of_folder, settings.data_folder, "data folder"),
            "temporary": await asyncio.to_thread(lack_of_folder, Path(tempfile.gettempdir()), "temporary folder"),
            "database": "" if is_reachable else "the database of the jobs does not answer; check it",
            "workers": "" if workers else f"none of {settings.workers} job workers is alive; see the log",
        }

    async def _is_reachable(self) -> bool:
        """Whether the database answers within `DATABASE_S`; one that hangs is asked by one task at a time."""
        if self._asking is None:
            self._asking = in_background(self._jobs.is_reachable())
        await asyncio.wait({self._asking}, timeout=DATABASE_S)
        if not self._asking.done():
            return False
        asked, self._asking = self._asking, None
        return asked.result()


def _missing(found: Mapping[str, str]) -> list[str]:
    return [name for name, reason in found.items() if reason]
