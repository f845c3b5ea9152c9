"""What one key may do to a service to keep others from it: the attacks of `bench_keys.py`.

Each goes on until it is cancelled; what ends or is refused is begun again.
"""

import asyncio
import io
import json
from collections.abc import Awaitable, Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from typing import Any

import httpx
import websockets

LONG = "We were away a year ago, but Bob may move five big maps. " * 1600  # 90,000 characters
PAUSES = "a<break time='10s'/>" * 4200  # 84 KB
AGAIN_S = 0.2
DRIP_S = 1.0
SIDE_PX = 6300
Client = httpx.AsyncClient


@dataclass(frozen=True, slots=True)
class Target:
    """Address of a service, and the attacker's key."""

    url: str
    key: str

    def client(self) -> Client:
        """A client with the key and any number of connections."""
        limits = httpx.Limits(max_connections=None)
        headers = {"authorization": f"Bearer {self.key}"}
        return Client(base_url=self.url, headers=headers, timeout=None, limits=limits)


def socket_of(url: str, key: str) -> Any:
    """A live stream of a key."""
    address = f"{url.replace('http', 'ws', 1)}/v1/stream"
    return websockets.connect(address, max_size=None, additional_headers={"authorization": f"Bearer {key}"})


async def _repeat(number: int, one: Callable[[], Awaitable[object]]) -> None:
    """So many at the same time, each again when it has ended."""

    async def again() -> None:
        while True:
            with suppress(httpx.HTTPError, OSError, websockets.WebSocketException):
                await one()
            await asyncio.sleep(AGAIN_S)

    await asyncio.gather(*(again() for _ in range(number)))


async def _clips(target: Target, number: int, **options: Any) -> None:
    async with target.client() as client:

        async def one() -> None:
            async with client.stream("POST", "/v1/clips", json=options) as answer:
                async for _ in answer.aiter_raw():
                    pass

        await _repeat(number, one)


async def _streams(target: Target, number: int, *, with_idle: bool) -> None:
    async def one() -> None:
        async with socket_of(target.url, target.key) as connection:
            await connection.send(json.dumps({"type": "start", "with_idle": with_idle}))
            async for _ in connection:
                pass

    await _repeat(number, one)


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

        async def one() -> None:
            async with client.stream("POST", "/v1/clips", json={"text": LONG, "format": "wav"}):
                await asyncio.sleep(3600)

        await _repeat(40, one)


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

        async def one() -> None:
            files = {"request": (None, json.dumps({"text": "Yes.", "size": "64x64"})), "background": ("a.png", content)}
            await client.post("/v1/clips", files=files)

        await _repeat(20, one)


async def pauses(target: Target) -> None:
    """A sentence of thousands of pauses."""
    await _clips(target, 4, text=PAUSES, format="mp3")


async def uploads(target: Target) -> None:
    """Recordings of a talker that arrive slowly."""
    head = b'--x\r\nContent-Disposition: form-data; name="name"\r\n\r\nabc\r\n'

    async def drip() -> Any:
        while True:
            yield head
            await asyncio.sleep(DRIP_S)

    async with target.client() as client:
        kind = {"content-type": "multipart/form-data; boundary=x", "content-length": str(10**8)}
        await _repeat(4, lambda: client.post("/v1/talkers/build", content=drip(), headers=kind))


async def webhooks(target: Target) -> None:
    """Jobs whose webhook is answered a byte at a time."""

    async def answer(_: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with suppress(OSError):
            writer.write(b"HTTP/1.1 200 OK\r\n")
            while True:
                writer.write(b"a")
                await writer.drain()
                await asyncio.sleep(DRIP_S)

    server = await asyncio.start_server(answer, "127.0.0.1", 0)
    address = f"http://127.0.0.1:{server.sockets[0].getsockname()[1]}/"
    order = {"kind": "clip", "request": {"text": "Yes.", "format": "mp3"}, "webhook": address}
    try:
        async with target.client() as client:
            await _repeat(4, lambda: client.post("/v1/jobs", json=order))
    finally:
        server.close()


ATTACKS: Mapping[str, Callable[[Target], Awaitable[None]]] = {
    attack.__name__: attack for attack in (silent, pages, sounds, movies, unread, pictures, pauses, uploads, webhooks)
}
