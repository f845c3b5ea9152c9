"""What a server does on SIGTERM: running clips finish, new requests are refused, nothing is left behind."""

import asyncio
import json
import os
import signal
import threading
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest
import websockets

from tests.running import TABLE_PROGRAM, RunningService, ServeProcess, eventually
from tests.serving.service.table_synthesis import FILM
from tests.started import children, running_processes

CLIP = {"text": "We were away a year ago.", "size": "128x128"}
HELD_PROGRAM = """
import sys, threading
from concurrent.futures import ThreadPoolExecutor
from cli.main import main
from tts2face.serving.service import server, warm_process

warm_process.PROGRAM = "tests.serving.service.table_synthesis:handlers"
server.EXIT_S = 0.5
ThreadPoolExecutor(1).submit(threading.Event().wait)  # is joined at the exit of Python
main()
"""


def wait_until_gone(pids: list[int]) -> None:
    eventually(lambda: not set(pids) & running_processes().keys())


def serve(drain_s: float) -> ServeProcess:
    """A service whose synthesis processes load no models."""
    environment = {"TTS2FACE_SERVE_DRAIN_S": str(drain_s), "TTS2FACE_SERVE_WORKERS": "0"}
    return ServeProcess(environment=environment, program=TABLE_PROGRAM)


@pytest.fixture
def own() -> Iterator[RunningService]:
    """A service of one test, which ends it."""
    running = serve(drain_s=120)
    try:
        running.wait_until_ready()
        yield running
    finally:
        running.process.kill()
        running.close()


def send_all(service: RunningService, number: signal.Signals) -> None:
    """Send a signal to the synthesis processes: SIGSTOP keeps a clip unfinished on any machine."""
    for pid, parent in running_processes().items():
        if parent == service.process.pid:
            os.kill(pid, number)


class Download(threading.Thread):
    """A clip that is received in the background; `has_begun` after its first bytes."""

    def __init__(self, url: str) -> None:
        super().__init__(daemon=True)
        self.url, self.content, self.error = url, b"", None
        self.has_begun = threading.Event()
        self.error: Exception | None
        self.start()

    def run(self) -> None:
        try:
            with httpx.stream("POST", f"{self.url}/v1/clips", json=CLIP, timeout=120) as answer:
                for part in answer.iter_bytes():
                    self.content += part
                    self.has_begun.set()
        except httpx.HTTPError as error:
            self.error = error
        finally:
            self.has_begun.set()


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="needs /proc")
def test_a_running_clip_finishes_after_sigterm(own: RunningService) -> None:
    processes = children(own.process.pid)
    assert processes
    download = Download(own.url)
    assert download.has_begun.wait(60)
    send_all(own, signal.SIGSTOP)
    own.process.send_signal(signal.SIGTERM)
    own.wait_for_event("draining")
    ready = httpx.get(f"{own.url}/readyz")
    assert (ready.status_code, ready.json()["checks"]["accepting"]) == (503, False)
    assert httpx.get(f"{own.url}/healthz").status_code == 200
    refused = httpx.post(f"{own.url}/v1/audio/speech", json={"input": "Hello.", "model": "tts-1", "voice": "alloy"})
    assert (refused.status_code, refused.json()["error"]["code"]) == (503, "draining")
    assert int(refused.headers["retry-after"]) >= 1
    send_all(own, signal.SIGCONT)
    download.join(120)
    assert download.error is None
    assert download.content == FILM
    assert own.process.wait(60) == 0
    wait_until_gone(processes)


def test_a_second_signal_ends_the_server_at_once(own: RunningService) -> None:
    processes = children(own.process.pid)
    download = Download(own.url)
    assert download.has_begun.wait(60)
    send_all(own, signal.SIGSTOP)
    own.process.send_signal(signal.SIGTERM)
    own.wait_for_event("draining")
    own.process.send_signal(signal.SIGTERM)
    assert own.process.wait(60) == 128 + signal.SIGTERM
    download.join(60)
    assert isinstance(download.error, httpx.RemoteProtocolError)  # the client sees that the clip is incomplete
    wait_until_gone(processes)


def test_streams_that_take_too_long_are_cut(tmp_path: Path) -> None:
    own = serve(drain_s=0.2)
    try:
        own.wait_until_ready()
        processes = children(own.process.pid)
        download = Download(own.url)
        assert download.has_begun.wait(60)
        send_all(own, signal.SIGSTOP)
        own.close()
        download.join(60)
        assert isinstance(download.error, httpx.RemoteProtocolError)
        assert any(event["event"] == "request" and event["cut"] for event in own.events())
        wait_until_gone(processes)
    finally:
        own.process.kill()


def test_websockets_get_a_message_and_the_code_of_a_restart(own: RunningService) -> None:
    async def open_socket(path: str) -> websockets.ClientConnection:
        connection = await websockets.connect(own.url.replace("http", "ws", 1) + path, max_size=None)
        if path == "/v1/stream":
            await connection.send(json.dumps({"type": "start"}))
            await connection.recv()
        return connection

    async def errors_and_code(connection: websockets.ClientConnection) -> tuple[list[object], int | None]:
        errors: list[object] = []
        try:
            while True:
                message = await asyncio.wait_for(connection.recv(), 60)
                came = json.loads(message) if isinstance(message, str) else {"type": "bytes"}
                errors += [(came["code"], came["message"])] if came["type"] == "error" else []
        except websockets.ConnectionClosed as closed:
            return errors, closed.rcvd.code if closed.rcvd else None

    async def run() -> list[tuple[list[object], int | None]]:
        sockets = [await open_socket(path) for path in ("/v1/stream", "/")]
        os.kill(own.process.pid, signal.SIGTERM)
        return list(await asyncio.gather(*map(errors_and_code, sockets)))

    assert asyncio.run(run()) == [([("draining", "the service is shutting down; connect again")], 1012)] * 2
    assert own.process.wait(60) == 0
    assert not any(event["event"] == "defect" for event in own.events())


def test_a_drained_server_ends_whatever_its_threads_wait_for() -> None:
    own = ServeProcess(environment={"TTS2FACE_SERVE_WORKERS": "0"}, program=("-c", HELD_PROGRAM))
    try:
        own.wait_until_ready()
        processes = children(own.process.pid)
        own.process.send_signal(signal.SIGTERM)
        assert own.process.wait(60) == 0
        wait_until_gone(processes)
    finally:
        own.process.kill()
        own.close()
