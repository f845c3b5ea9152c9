"""Clients that leave while their request waits: it leaves the queue at once, whatever runs meanwhile."""

import asyncio
import json
import socket
import time
from collections.abc import Iterator
from contextlib import AsyncExitStack, ExitStack, closing

import httpx
import pytest
import websockets

from tests.running import HostService, RunningService, eventually
from tests.serving.service.raw import connect
from tts2face.serving.service.pool import LINES_COST, LIVE_COST, MOVIE_COST, PLACES, SOUND_COST

LONG = "We were away a year ago, but Bob may move five big maps. " * 100
CLIP = json.dumps({"text": LONG}).encode()
SOUND, LINES = (json.dumps({"text": LONG, "format": format}).encode() for format in ("mp3", "curves"))
WAITING, LOAD = "tts2face_waiting", "tts2face_load"
N_MOVIES = PLACES[MOVIE_COST]
OCCUPYING = [*[SOUND] * PLACES[SOUND_COST], *[LINES] * PLACES[LINES_COST]]  # all places but those of movies
N_FULL = PLACES[SOUND_COST] * SOUND_COST + PLACES[LINES_COST] * LINES_COST
FULL = pytest.approx(N_FULL)
N_CLIENTS = 5
PAUSE_S = 0.1  # after which the server has read the request


def measure(service: RunningService, name: str) -> float:
    lines = httpx.get(f"{service.url}/metrics", timeout=60).text.splitlines()
    return next(float(line.split()[-1]) for line in lines if line.startswith(f"{name} "))


@pytest.fixture(scope="module")
def running(host: HostService) -> Iterator[RunningService]:
    with host(workers=0) as running:
        yield running
        assert "defect" not in {event["event"] for event in running.events()}


@pytest.fixture
def occupied(running: RunningService) -> Iterator[RunningService]:
    """A service whose process makes as much sound, and as many lines, as it takes."""
    eventually(lambda: measure(running, LOAD) == 0.0)
    with ExitStack() as stack:
        for body in OCCUPYING:
            stack.enter_context(closing(ask(running, "/v1/clips", body)))
        eventually(lambda: measure(running, LOAD) == FULL)
        yield running
    eventually(lambda: measure(running, LOAD) == 0.0, 30.0)


def ask(service: RunningService, path: str, body: bytes, then: bytes = b"") -> socket.socket:
    connection = connect(service.url)
    connection.sendall(f"POST {path} HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n".encode())
    connection.sendall(f"Content-Length: {len(body)}\r\n\r\n".encode() + body)
    if then:
        time.sleep(PAUSE_S)
        connection.sendall(then)
    return connection


@pytest.mark.parametrize("then", [b"", b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n" * 100], ids=["", "next"])
@pytest.mark.parametrize(
    ("path", "body"),
    [
        ("/v1/clips", {"text": "Hello.", "format": "mp3"}),
        ("/v1/audio/speech", {"input": "Hello.", "voice": "alloy", "model": "tts-1"}),
        ("/v1/synthesize", {"input": "Hello."}),
    ],
)
def test_requests_whose_client_has_left_do_not_wait(
    occupied: RunningService, path: str, body: dict[str, str], then: bytes
) -> None:
    with ExitStack() as connections:
        for _ in range(N_CLIENTS):
            connections.enter_context(closing(ask(occupied, path, json.dumps(body).encode(), then)))
        eventually(lambda: measure(occupied, WAITING) == N_CLIENTS)
    eventually(lambda: measure(occupied, WAITING) == 0.0, 30.0)
    assert measure(occupied, LOAD) == FULL  # none of them has run
    found = [one for one in occupied.events() if one["event"] == "request" and one["path"] == path]
    assert [(one["status"], one["code"]) for one in found[-N_CLIENTS:]] == [(499, "left")] * N_CLIENTS


@pytest.mark.parametrize(
    ("path", "messages", "name", "number"),
    [
        (
            "/v1/stream", [{"type": "start"}, *({"type": "text", "text": LONG[:1000]} for _ in range(20))],
            LOAD, N_FULL + N_CLIENTS * LIVE_COST,
        ),
        (
            "/", [{"type": "synthesize", "id": number, "data": {"input": "Hello."}} for number in range(20)],
            WAITING, N_CLIENTS,
        ),
    ],
)  # fmt: skip
def test_sockets_whose_client_has_left_hold_nothing(
    occupied: RunningService, path: str, messages: list[dict[str, object]], name: str, number: float
) -> None:
    """Also where the client has sent much that nobody has read; live streams begin at once, whatever runs."""

    async def leave() -> None:
        address = occupied.url.replace("http", "ws", 1) + path
        async with AsyncExitStack() as stack:
            sockets = [await stack.enter_async_context(websockets.connect(address)) for _ in range(N_CLIENTS)]
            for one in sockets:
                for message in messages:
                    await one.send(json.dumps(message))
            await asyncio.to_thread(eventually, lambda: measure(occupied, name) == pytest.approx(number))
            for one in sockets:
                one.transport.abort()

    asyncio.run(leave())
    eventually(lambda: measure(occupied, WAITING) == 0.0 and measure(occupied, LOAD) == FULL, 30.0)


def test_what_runs_for_clients_that_have_left_stops(running: RunningService) -> None:
    """Clients that leave in the queue and in the middle of their clips: the next request finds a free process."""
    eventually(lambda: measure(running, LOAD) == 0.0)
    made = measure(running, "tts2face_speech_seconds_total")
    with ExitStack() as connections:
        for _ in range(40):
            connections.enter_context(closing(ask(running, "/v1/clips", CLIP)))
        eventually(lambda: measure(running, WAITING) == 40 - N_MOVIES)
    eventually(lambda: measure(running, LOAD) == 0.0 == measure(running, WAITING), 30.0)
    assert measure(running, "tts2face_speech_seconds_total") == made  # counted at the end of works: none was completed
