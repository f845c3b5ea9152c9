"""Many requests at once, many after each other, and clients that vanish: nothing but 200 and 429, nothing leaks."""

import asyncio
import os
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from tempfile import gettempdir

import httpx
import pytest
import websockets

from tests.running import HostService, RunningService, eventually
from tests.service.raw import connect, request
from tests.started import children

pytestmark = pytest.mark.skipif(not Path("/proc/self/fd").is_dir(), reason="needs /proc")
SPEECH = {"input": "Hello there.", "model": "tts-1", "voice": "alloy", "response_format": "pcm"}
LONG = "We were away a year ago, but Bob may move five big maps. " * 20
# Allocators keep some memory; a leak of a request's sound alone (50 kB) would be 10 MB in 200 requests.
MAX_GROWTH_BYTES = 60_000_000


@dataclass(frozen=True, slots=True)
class Usage:
    """What a server and its processes hold."""

    server_bytes: int
    synthesis_bytes: int
    n_threads: int
    n_files: int
    n_children: int


def resident_bytes(pid: int) -> int:
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def usage(service: RunningService) -> Usage:
    server, synthesis = service.process.pid, children(service.process.pid)
    every = (server, *synthesis)
    return Usage(
        resident_bytes(server),
        sum(map(resident_bytes, synthesis)),
        sum(len(os.listdir(f"/proc/{pid}/task")) for pid in every),
        sum(len(os.listdir(f"/proc/{pid}/fd")) for pid in every),
        len(synthesis),
    )


def wait_until_idle(service: RunningService) -> None:
    """Wait until no work runs or waits and all connections are closed."""
    quiet = {"tts2face_waiting 0.0", "tts2face_load 0.0"}
    eventually(lambda: quiet <= set(httpx.get(f"{service.url}/metrics").text.splitlines()), 120.0)


@pytest.fixture(scope="module")
def loaded(host: HostService) -> Iterator[RunningService]:
    with host(keep_alive_s=1, workers=0) as running:
        yield running


async def speak_many(url: str, n_requests: int, n_at_once: int) -> Counter[int]:
    """Statuses of short requests."""
    limits = httpx.Limits(max_connections=n_at_once, max_keepalive_connections=0)
    gate = asyncio.Semaphore(n_at_once)
    async with httpx.AsyncClient(base_url=url, limits=limits, timeout=300) as client:

        async def one() -> int:
            async with gate:
                return (await client.post("/v1/audio/speech", json=SPEECH)).status_code

        return Counter(await asyncio.gather(*(one() for _ in range(n_requests))))


def test_two_hundred_at_once_get_200_or_429(loaded: RunningService) -> None:
    statuses = asyncio.run(speak_many(loaded.url, 200, 200))
    assert set(statuses) <= {200, 429}
    assert statuses[200] >= 64  # those that may wait, at least


def test_many_requests_leave_nothing_behind(loaded: RunningService) -> None:
    asyncio.run(speak_many(loaded.url, 60, 8))
    wait_until_idle(loaded)
    time.sleep(1.5)  # keep-alive
    before = usage(loaded)
    assert asyncio.run(speak_many(loaded.url, 200, 8)) == {200: 200}
    wait_until_idle(loaded)
    time.sleep(1.5)
    assert_no_growth(before, usage(loaded))


def assert_no_growth(before: Usage, after: Usage) -> None:
    assert after.server_bytes - before.server_bytes < MAX_GROWTH_BYTES
    assert after.synthesis_bytes - before.synthesis_bytes < MAX_GROWTH_BYTES
    assert after.n_children == before.n_children
    assert after.n_threads - before.n_threads <= 4  # a pool of threads for blocking calls grows to its size once
    assert after.n_files - before.n_files <= 4


def vanish(url: str, n: int) -> None:
    """Clients that leave: three times n in the middle of a clip, n of an upload, and n of a live stream."""
    body = f'{{"text": "{LONG}", "size": "128x128"}}'.encode()
    for _ in range(3 * n):
        with connect(url) as connection:
            connection.sendall(request("POST", "/v1/clips", body))
            assert connection.recv(10)
    for _ in range(n):
        with connect(url) as connection:
            connection.sendall(request("POST", "/v1/clips", body)[:-100])
    asyncio.run(leave_live_streams(url, n))


def test_clients_that_vanish_leave_nothing_behind(loaded: RunningService) -> None:
    """50 clients that close their connection in the middle of a clip, of an upload, or of a live stream."""
    vanish(loaded.url, 4)
    wait_until_idle(loaded)
    time.sleep(1.5)
    before, folders = usage(loaded), set(Path(gettempdir()).glob("tts2face-upload-*"))
    vanish(loaded.url, 10)
    wait_until_idle(loaded)
    time.sleep(1.5)
    assert_no_growth(before, usage(loaded))
    assert set(Path(gettempdir()).glob("tts2face-upload-*")) == folders
    assert asyncio.run(speak_many(loaded.url, 3, 3)) == {200: 3}


async def leave_live_streams(url: str, n_clients: int) -> None:
    for _ in range(n_clients):
        async with websockets.connect(url.replace("http", "ws", 1) + "/v1/stream", max_size=None) as connection:
            await connection.send('{"type": "start"}')
            await connection.recv()
            connection.transport.abort()
