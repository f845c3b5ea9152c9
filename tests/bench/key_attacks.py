"""What one key may do to a service to keep others from it: the attacks of `bench_keys.py`.

Each goes on until it is cancelled; what ends or is refused is begun again.
"""

import asyncio
import io
import json
from collections import Counter
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import httpx
import websockets

LONG = "We were away a year ago, but Bob may move five big maps. " * 1600  # 90,000 characters
PAUSES = "a<break time='10s'/>" * 4200  # 84 KB
AGAIN_S = 0.2
DRIP_S, UNREAD_S = 1.0, 100.0  # less than `stall_s`
SIDE_PX = 6300
Client = httpx.AsyncClient


@dataclass(frozen=True, slots=True)
class Target:
    """Address of a service, the attacker's key and port for webhooks, and how often it got which status or error."""

    url: str
    key: str
    port: int
    statuses: Counter[str] = field(default_factory=Counter)

    async def repeat(self, number: int, one: Callable[[], Awaitable[object]]) -> None:
        """So many at the same time, each again when it has ended with a status or an error."""

        async def again() -> None:
            while True:
                try:
                    self.statuses[str(await one())] += 1
                except (httpx.HTTPError, OSError, websockets.WebSocketException) as error:
                    self.statuses[type(error).__name__] += 1
                await asyncio.sleep(AGAIN_S)

        await asyncio.gather(*(again() for _ in range(number)))

    def client(self) -> Client:
        """A client with the key and any number of connections."""
        limits = httpx.Limits(max_connections=None)
        headers = {"authorization": f"Bearer {self.key}"}
        return Client(base_url=self.url, headers=headers, timeout=None, limits=limits)


def socket_of(url: str, key: str) -> Any:
    """A live stream of a key."""
    address = f"{url.replace('http', 'ws', 1)}/v1/stream"
    return websockets.connect(address, max_size=None, additional_headers={"authorization": f"Bearer {key}"})


async def _clips(target: Target, number: int, **options: Any) -> None:
    async with target.client() as client:

        async def one() -> int:
            async with client.stream("POST", "/v1/clips", json=options) as answer:
                async for _ in answer.aiter_raw():
                    pass
            return answer.status_code

        await target.repeat(number, one)


async def _streams(target: Target, number: int, *, with_idle: bool) -> None:
    async def one() -> None:
        async with socket_of(target.url, target.key) as connection:
            await connection.send(json.dumps({"type": "start", "with_idle": with_idle}))
            async for _ in connection:
                pass

    await target.repeat(number, one)


async def silent(target: Target) -> None:
    """Live streams to which nothing is said."""
    await _streams(target, 60, with_idle=False)


async def pages(target: Target) -> None:
    """Avatar pages, whose faces live, to which nothing is said."""
    await _streams(target, 100, with_idle=True)


async def sounds(target: Target) -> None:
    """Long texts as sound."""
    await _clips(target, 40, text=LONG, format="mp3")


async def movies(target: Target) -> None:
    """Long texts as movies."""
    await _clips(target, 16, text=LONG, format="mp4", size="512x512")


async def unread(target: Target) -> None:
    """Long texts whose answers nobody reads."""
    async with target.client() as client:

        async def one() -> int:
            async with client.stream("POST", "/v1/clips", json={"text": LONG, "format": "wav"}) as answer:
                await asyncio.sleep(UNREAD_S)
            return answer.status_code

        await target.repeat(40, one)


@cache
def _large_picture() -> bytes:
    from PIL import Image

    file = io.BytesIO()
    Image.new("RGB", (SIDE_PX, SIDE_PX), (90, 120, 150)).save(file, "PNG")
    return file.getvalue()


async def pictures(target: Target) -> None:
    """Clips before a picture that is small as a file and large in memory."""
    content = _large_picture()
    async with target.client() as client:

        async def one() -> int:
            files = {"request": (None, json.dumps({"text": "Yes.", "size": "64x64"})), "background": ("a.png", content)}
            return (await client.post("/v1/clips", files=files)).status_code

        await target.repeat(20, one)


async def pauses(target: Target) -> None:
    """A sentence of thousands of pauses."""
    await _clips(target, 4, text=PAUSES, format="mp3")


async def uploads(target: Target) -> None:
    """Recordings of a talker that arrive slowly."""

    async def drip() -> AsyncIterator[bytes]:
        yield b'--x\r\nContent-Disposition: form-data; name="recordings"; filename="a.mp4"\r\n\r\n'
        while True:
            await asyncio.sleep(DRIP_S)
            yield b"a"

    async with target.client() as client:
        kind = {"content-type": "multipart/form-data; boundary=x", "content-length": str(10**8)}

        async def one() -> int:
            return (await client.post("/v1/talkers/build", content=drip(), headers=kind)).status_code

        await target.repeat(4, one)


async def webhooks(target: Target) -> None:
    """Jobs whose webhook is answered a byte at a time."""

    async def answer(_: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with suppress(OSError, asyncio.CancelledError):  # the second when the attack ends
            writer.write(b"HTTP/1.1 200 OK\r\n")
            while True:
                writer.write(b"a")
                await writer.drain()
                await asyncio.sleep(DRIP_S)

    server = await asyncio.start_server(answer, "127.0.0.1", target.port)
    order = {
        "kind": "clip",
        "request": {"text": "Yes.", "format": "mp3"},
        "webhook": f"http://127.0.0.1:{target.port}/",
    }
    try:
        async with target.client() as client:

            async def one() -> int:
                return (await client.post("/v1/jobs", json=order)).status_code

            await target.repeat(4, one)
    finally:
        server.close()


ATTACKS: Mapping[str, Callable[[Target], Awaitable[None]]] = {
    attack.__name__: attack for attack in (silent, pages, sounds, movies, unread, pictures, pauses, uploads, webhooks)
}
