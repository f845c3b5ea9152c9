"""Running the service with uvicorn."""

import json
import logging
import socket

import uvicorn

from tts2face.service.app import create_app
from tts2face.service.settings import ServiceSettings
from tts2face.service.state import LOG
from tts2face.telemetry import disable_telemetry


def serve(settings: ServiceSettings) -> None:
    """Serve until SIGTERM or SIGINT; running requests then have `drain_s` seconds to finish.

    Raises
    ------
    InputError, DataError
        The file of keys cannot be read.
    """
    disable_telemetry()
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    app = create_app(settings)
    server = DrainingServer(uvicorn.Config(
        app, host=settings.host, port=settings.port, log_level="warning", access_log=False, server_header=False,
        timeout_graceful_shutdown=int(settings.drain_s), limit_concurrency=4096, ws_max_size=1 << 20, lifespan="on",
        timeout_keep_alive=15, h11_max_incomplete_event_size=64 << 10,
    ))  # fmt: skip
    server.run()


class DrainingServer(uvicorn.Server):
    """Server that says where it listens and that it is shutting down."""

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Listen; then write the address, whose port may have been chosen by the system."""
        await super().startup(sockets)
        for server in self.servers:
            for one in server.sockets:
                host, port = one.getsockname()[:2]
                LOG.info(json.dumps({"event": "listening", "url": f"http://{host}:{port}"}))

    def handle_exit(self, sig: int, frame: object) -> None:
        """Refuse new work while running requests finish."""
        self.config.app.state.service.is_draining = True  # type: ignore[union-attr]
        super().handle_exit(sig, frame)  # type: ignore[arg-type]
