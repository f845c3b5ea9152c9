"""Mixed requests of many clients, some of whom vanish: the traffic of `tests/bench/bench_soak.py`."""

import asyncio
import json
import random
from collections import Counter
from collections.abc import Awaitable, Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx
import websockets

from tests.running import ServeProcess
from tests.serving.service.raw import connect, request
from tests.serving.service.receiver import Receiver
from tests.serving.work.conftest import Postgres

SEED, AT_ONCE = 1, 24
LONG = "We were away a year ago, but Bob may move five big maps. " * 20
LEAVING = b'{"text": "%s", "size": "128x128"}' % LONG.encode()
SUBTITLES = b"1\n00:00:00,500 --> 00:00:02,000\nWe may.\n"
CUT, LOST = -1, -2  # an answer that has begun and ended before its end; none, or one that no server may give
BUSY = {429, 503}  # 503 while the disk is full, the database away or the processes killed
JSON = {"content-type": "application/json"}
Client = httpx.AsyncClient


@dataclass(slots=True)
class Soak:
    """A run: the server and what it needs, what it answered, and the jobs that it has accepted."""

    server: ServeProcess
    folder: Path
    receiver: Receiver
    postgres: Postgres | None
    away_s: float
    rng: random.Random = field(default_factory=lambda: random.Random(SEED))
    statuses: Counter[tuple[str, int]] = field(default_factory=Counter)
    jobs: list[str] = field(default_factory=list)
    begun: set[asyncio.Task[Any] | None] = field(default_factory=set)  # whose answer has a whole head

    async def note_begun(self, _: httpx.Response) -> None:
        """Note that the answer to the request of the present task has begun."""
        self.begun.add(asyncio.current_task())

    async def one(self, client: Client, name: str) -> None:
        """One request of `KINDS`; a client that vanishes has the status 0."""
        self.begun.discard(asyncio.current_task())
        try:
            status = await KINDS[name][1](self, client)
        except (httpx.HTTPError, OSError, websockets.WebSocketException) as error:
            # an answer that fails ends within the trailer that says why, one of a killed server anywhere in its body
            is_cut = isinstance(error, httpx.RemoteProtocolError) and asyncio.current_task() in self.begun
            status = CUT if is_cut else LOST
            print(f"  {name}: {error!r}", flush=True)
        self.statuses[name, status] += 1


async def _speech(soak: Soak, client: Client) -> int:
    body = {"input": soak.rng.choice(["Yes.", "Hello there.", "We may."]), "model": "tts-1", "voice": "alloy"}
    return (await client.post("/v1/audio/speech", json=body)).status_code


async def _curves(soak: Soak, client: Client) -> int:
    return (await client.post("/v1/clips", json={"text": _unseen(soak), "format": "curves"})).status_code


async def _film(soak: Soak, client: Client) -> int:
    return (await client.post("/v1/clips", json={"text": "We may.", "size": "64x64"})).status_code


async def _headtts(soak: Soak, client: Client) -> int:
    return (await client.post("/v1/synthesize", json={"input": "Hello.", "voice": "af_bella"})).status_code


async def _wrong(soak: Soak, client: Client) -> int:
    body = soak.rng.choice([b"{", b'{"text": 3}', b'{"text": "a", "rate": 9}', b"\xff"])
    return (await client.post("/v1/clips", content=body, headers=JSON)).status_code


async def _vanish(soak: Soak, client: Client) -> int:
    """A client that leaves in the queue, or in the middle of a clip."""
    seconds, waits = soak.rng.uniform(0.05, 1.5), soak.rng.random() < 0.5
    with suppress(TimeoutError, StopAsyncIteration):
        async with asyncio.timeout(None if waits else seconds):
            async with client.stream("POST", "/v1/clips", content=LEAVING, headers=JSON) as answer:
                await anext(answer.aiter_bytes())
    return 0


async def _vanish_upload(soak: Soak, _: Client) -> int:
    with connect(soak.server.url) as connection:
        connection.sendall(request("POST", "/v1/clips", LEAVING)[:-100])
    return 0


async def _live(soak: Soak, _: Client) -> int:
    """A live stream whose client closes it, or is gone."""
    async with websockets.connect(soak.server.url.replace("http", "ws", 1) + "/v1/stream", max_size=None) as socket:
        await socket.send(json.dumps({"type": "start"}))
        await socket.send(json.dumps({"type": "text", "text": "We may."}))
        await socket.recv()
        with suppress(TimeoutError):
            async with asyncio.timeout(soak.rng.uniform(0.0, 1.0)):
                async for _ in socket:
                    pass
        if soak.rng.random() < 0.5:
            socket.transport.abort()
    return 200


async def _job(soak: Soak, client: Client) -> int:
    options = {"webhook": f"http://{soak.receiver.host}/"}
    if soak.rng.random() < 0.7:
        order = {"kind": "clip", "request": {"text": _unseen(soak), "format": "mp3"}}
        answer = await client.post("/v1/jobs", json=order | options)
    else:
        order = {"kind": "subtitles", "request": {"format": "mp4", "size": "64x64"}}
        files = {"subtitles": ("a.srt", SUBTITLES)}
        answer = await client.post("/v1/jobs", data={"job": json.dumps(order | options)}, files=files)
    if answer.status_code == 202:
        soak.jobs.append(answer.json()["id"])
    return answer.status_code


def _unseen(soak: Soak) -> str:
    """A text that the server does not remember."""
    return f"Number {soak.rng.randrange(10**6)} is here."


KINDS: Mapping[str, tuple[float, Callable[[Soak, Client], Awaitable[int]], set[int]]] = {  # share, how, its statuses
    "speech": (0.4, _speech, {200} | BUSY), "curves": (0.15, _curves, {200} | BUSY),
    "film": (0.05, _film, {200} | BUSY), "headtts": (0.1, _headtts, {200} | BUSY),
    "wrong": (0.1, _wrong, {400, 422} | BUSY), "vanish": (0.08, _vanish, {0}),
    "vanish in an upload": (0.02, _vanish_upload, {0}), "live": (0.05, _live, {200}),
    "job": (0.05, _job, {202} | BUSY),
}  # fmt: skip


def client_of(soak: Soak) -> Client:
    limits = httpx.Limits(max_connections=AT_ONCE, max_keepalive_connections=0)
    hooks = {"response": [soak.note_begun]}
    return Client(base_url=soak.server.url, limits=limits, timeout=300, event_hooks=hooks)


async def drive(soak: Soak, n: int) -> None:
    """Make one request of each kind, and others up to a number, `AT_ONCE` of them at the same time."""
    names = list(KINDS)
    names += soak.rng.choices(names, [share for share, *_ in KINDS.values()], k=max(n - len(names), 0))
    left = iter(names)
    async with client_of(soak) as client:

        async def go_on() -> None:
            for name in left:
                await soak.one(client, name)

        await asyncio.gather(*(go_on() for _ in range(AT_ONCE)))
