"""Many services in one process, each with settings of its own, that share one pool of warm synthesis processes.

A service of its own process takes 10 to 17 s of processor time until it is ready; one of this process a few tenths.
``python -m tests.serving.service.host FOLDER`` starts one for each line of standard input,
``{"number": 1, "variables": {"TTS2FACE_SERVE_WORKERS": "0"}, "studio": false}``, and ends it on ``{"end": 1}``. The
first one with the studio also has the page of `tests.serving.studio.harness`, whose files lie in FOLDER.
"""

import asyncio
import json
import os
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from tts2face.numeric.telemetry import disable_telemetry
from tts2face.serving.service import job_service
from tts2face.serving.service import pool as service_pool
from tts2face.serving.service import state as service_state
from tts2face.serving.service.logs import configure_logs, log_event
from tts2face.serving.service.pool import Pool, PoolSettings
from tts2face.serving.service.server import DrainingServer, make_server
from tts2face.serving.service.settings import ServiceSettings, read_settings
from tts2face.serving.studio.requests import TASKS


class SharedPool(Pool):
    """The pool of all services: it starts with the first one, and ends with the process."""

    def start(self) -> None:
        """Start the processes, once."""
        if not self._runs:
            super().start()

    async def close(self) -> None:
        """Leave the processes to the other services."""


class Host:
    """The running services by number.

    Parameters
    ----------
    folder
        Files of the harness.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._servers: dict[int, tuple[DrainingServer, asyncio.Task[None]]] = {}
        self._pool: SharedPool | None = None
        service_state.Pool = self._shared_pool  # type: ignore[misc, assignment]
        job_service.NICENESS = service_pool.NICENESS = (
            0  # jobs and the studio's face do not wait for the other tests of the run
        )

    def _shared_pool(self, settings: PoolSettings) -> SharedPool:
        if self._pool is None:
            self._pool = SharedPool(replace(settings, handlers={**settings.handlers, "tasks": TASKS}))
        return self._pool

    async def answer(self, order: dict[str, Any]) -> None:
        """Start or end a service; the log says when it is done."""
        if "end" in order:
            server, task = self._servers.pop(order["end"])
            server.should_exit = True
            await task
            return log_event("ended", number=order["end"])
        os.environ |= order["variables"]
        try:
            settings = replace(read_settings(), port=0, processes=1, studio=order["studio"])
            server = self._make_server(settings, self._mounts() if order["studio"] else [])
        finally:
            for name in order["variables"]:
                del os.environ[name]
        self._servers[order["number"]] = server, asyncio.create_task(server._serve())
        while not server.started:
            await asyncio.sleep(0.01)
        port = server.servers[0].sockets[0].getsockname()[1]
        return log_event("started", number=order["number"], url=f"http://127.0.0.1:{port}")

    def _make_server(self, settings: ServiceSettings, mounts: list[Any]) -> DrainingServer:
        """A server whose metrics, and those of the earlier ones, hear of works that were cancelled."""
        known = [] if self._pool is None else [process.on_cancelled for process in self._pool.processes]
        server = make_server(settings, mounts)
        assert self._pool is not None
        for process, earlier in zip(self._pool.processes, known, strict=False):
            process.on_cancelled = partial(_call_both, earlier, process.on_cancelled)
        return server

    def _mounts(self) -> list[Any]:
        from tests.serving.studio.harness import add_page
        from tts2face.serving.studio.app import STUDIO

        add_page(self._folder)
        return [STUDIO]


def _call_both(one: Callable[[float], None], other: Callable[[float], None], seconds: float) -> None:
    one(seconds)
    other(seconds)


async def main(folder: Path) -> None:
    """Follow the lines of standard input until it ends."""
    host, loop = Host(folder), asyncio.get_running_loop()
    while line := await loop.run_in_executor(None, sys.stdin.readline):
        await host.answer(json.loads(line))


if __name__ == "__main__":
    disable_telemetry()
    configure_logs()
    try:
        asyncio.run(main(Path(sys.argv[1])))
    finally:
        sys.stderr.flush()
        os._exit(0)  # the synthesis processes end with their parent
