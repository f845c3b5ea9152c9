"""Running the service with uvicorn."""

import asyncio
import os
import signal
import socket
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress

import uvicorn

from tts2face.processes.collection import resume_collection
from tts2face.serving.service.application import Mount, create_app
from tts2face.serving.service.connections import connection_classes
from tts2face.serving.service.errors import draining
from tts2face.serving.service.logs import configure_logs, log_event
from tts2face.serving.service.page_addresses import PAGES
from tts2face.serving.service.settings import ServiceSettings
from tts2face.serving.service.state import ServiceState
from tts2face.sound.voice_urls import NAMES_VARIABLE
from tts2face.storage.signing import Credentials
from tts2face.storage.temporary import remove_held

SOCKET_GRACE_S = 3.0  # between the message to the clients of WebSockets and their end
FORCED_CODE = 143  # exit code after a second signal; 0 after the first
CUT_S = 2  # in which requests that were cut release what they hold
EXIT_S = 10.0  # after the last request, in which the process ends, whatever its threads wait for


def serve(settings: ServiceSettings, mounts: Sequence[Mount] = ()) -> None:
    """Serve until SIGTERM or SIGINT; running requests then have `drain_s` seconds to finish.

    Raises
    ------
    InputError, DataError
        The file of keys cannot be read, the certificate or key of signatures is wrong, or the variables of
        OpenTelemetry ask for something else than OTLP over HTTP.
    BackendError
        Traces are asked for and their libraries are missing.
    """
    configure_logs(settings.log_format, with_text=settings.log_text)
    if settings.voices:  # for the processes of the service, too
        os.environ[NAMES_VARIABLE] = " ".join(settings.voices)
    if settings.signing is not None:
        signer = Credentials.from_json(settings.signing).open()
        log_event("signing", certificate_ends=signer.ends, has_time_stamps=bool(signer.authority))
    _allow_files(settings.connections)
    server = make_server(settings, mounts)
    server.exit_s = EXIT_S
    with _signals_of_process():
        server.run()
    if server.force_exit:
        sys.exit(FORCED_CODE)


@contextmanager
def _signals_of_process() -> Iterator[None]:
    """Return the signals to who watched them before: asyncio takes their file descriptor and gives none back.

    A second signal ends a process that still waits for a thread at its exit.
    """
    descriptor = signal.set_wakeup_fd(-1)
    try:
        yield
    finally:
        signal.set_wakeup_fd(descriptor, warn_on_full_buffer=False)


def make_server(settings: ServiceSettings, mounts: Sequence[Mount] = ()) -> "DrainingServer":
    """Server of an application with the given settings, before it runs."""
    app = create_app(settings, mounts)
    http, socket_class = connection_classes(settings)
    return DrainingServer(uvicorn.Config(
        app, host=settings.host, port=settings.port, http=http, ws=socket_class,  # type: ignore[arg-type]
        loop="asyncio",  # whatever else is installed
        log_config=None, log_level="warning", access_log=False, server_header=False, proxy_headers=False,
        timeout_graceful_shutdown=CUT_S, ws_max_size=1024 * settings.message_kb, lifespan="on",
        ws_per_message_deflate=False,  # a few bytes would become megabytes in one step of the event loop
        timeout_keep_alive=settings.keep_alive_s,  # type: ignore[arg-type]
        h11_max_incomplete_event_size=1024 * settings.head_kb,
    ), app.state.service)  # fmt: skip


class DrainingServer(uvicorn.Server):
    """Server that says where it listens, and that refuses new requests while the running ones finish."""

    def __init__(self, config: uvicorn.Config, state: ServiceState) -> None:
        super().__init__(config)
        self._state = state
        self._reloading: set[asyncio.Task[None]] = set()
        self.exit_s: float | None = None  # of a process that is this server's: `EXIT_S`

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Listen; then write the address, whose port may have been chosen by the system."""
        await super().startup(sockets)
        resume_collection()
        # not on Windows
        if hasattr(signal, "SIGHUP"):
            asyncio.get_running_loop().add_signal_handler(signal.SIGHUP, self._reload_keys)
        for server in self.servers:
            for opened in server.sockets:
                host, port = opened.getsockname()[:2]
                url = f"http://{host}:{port}"
                log_event("listening", url=url, studio=f"{url}{PAGES}" if self._state.settings.studio else None)

    def _reload_keys(self) -> None:
        task = asyncio.get_running_loop().create_task(self._state.reload_keys())
        self._reloading.add(task)
        task.add_done_callback(self._reloading.discard)

    async def main_loop(self) -> None:
        """Serve until a signal comes, then until the running requests are complete, or `drain_s` seconds."""
        await super().main_loop()
        state, began = self._state, time.monotonic()
        state.is_draining = True
        log_event("draining", running=len(state.running), seconds=state.settings.drain_s)
        telling = asyncio.create_task(self._end_sockets())
        # the port stays open, so that /readyz can say why (decision 100)
        while state.running and not self.force_exit and time.monotonic() < began + state.settings.drain_s:
            await asyncio.sleep(0.05)
        telling.cancel()
        await asyncio.gather(*(request.cut(draining()) for request in state.running))
        log_event("drained", seconds=round(time.monotonic() - began, 3))
        if self.exit_s is not None:
            threading.Thread(target=_exit_after, args=(self.exit_s, self), name="exit", daemon=True).start()

    def handle_exit(self, sig: int, frame: object) -> None:
        """Begin to drain; a second signal ends the server at once."""
        self.force_exit = self.should_exit
        self.should_exit = self._state.is_draining = True

    async def _end_sockets(self) -> None:
        sockets = [request for request in self._state.running if request.scope["type"] == "websocket"]
        telling = [asyncio.create_task(request.announce_end(draining("connect again"))) for request in sockets]
        await asyncio.sleep(min(SOCKET_GRACE_S, self._state.settings.drain_s))
        for task in telling:  # of clients that read nothing
            task.cancel()
        await asyncio.gather(*(request.cut(draining()) for request in sockets if request in self._state.running))


def _exit_after(seconds: float, server: DrainingServer) -> None:
    """End the process: no thread that waits for another machine keeps a drained server."""
    time.sleep(seconds)
    remove_held()
    os._exit(FORCED_CODE if server.force_exit else 0)


def _allow_files(connections: int) -> None:
    """Raise the limit of open files to what the connections need, as far as the system allows."""
    with suppress(ImportError, OSError, ValueError):
        import resource

        soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        wanted = 2 * connections + 256
        # a connection is a file, and each may bring a temporary one
        if soft != resource.RLIM_INFINITY and soft < wanted:
            most = wanted if hard == resource.RLIM_INFINITY else min(wanted, hard)
            resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, most), hard))
