"""Hostile WebSockets, and too many connections, against a real server, which serves on."""

import asyncio
import json
import os
import struct
from pathlib import Path

import pytest
import websockets

from tests.running import HostService, RunningService, eventually
from tests.serving.service.attacked import alive, attacked
from tests.serving.service.raw import ask, connect, head

__all__ = ["alive", "attacked"]  # fixtures


PATHS = ("/v1/stream", "/")


def attack(service: RunningService, path: str, *messages: object, raw: bytes = b"") -> int | None:
    """Send messages (bytes: binary); the close code with which the connection ends, None if the client ends it."""

    async def run() -> int | None:
        address = service.url.replace("http", "ws", 1) + path
        async with websockets.connect(address, max_size=None, compression="deflate") as connection:
            try:
                for message in messages:
                    await connection.send(message if isinstance(message, str | bytes) else json.dumps(message))
                if raw:
                    connection.transport.write(raw)
                async with asyncio.timeout(1):
                    while True:
                        await connection.recv()
            except websockets.ConnectionClosed as closed:
                return closed.rcvd.code if closed.rcvd else 1006
            except TimeoutError:
                return None

    return asyncio.run(run())


@pytest.mark.parametrize("path", PATHS)
@pytest.mark.parametrize(
    ("message", "codes"),
    [
        ("x" * 100_000, {1009}),
        (b"x" * 100_000, {1009}),
        (" " * 10_000_000, {1009}),  # 10 kB with compression
        (b"\x00\xff", {None, 1000, 1003, 1007}),
        ("[" * 30_000, {None, 1000, 1007}),
        ('{"type": "start", "fps": NaN}', {None, 1000, 1007}),
        ('{"type": "synthesize", "id": 1, "data": {"input": [[[]]]}}', {None, 1007}),
        ('{"type": "synthesize", "id": 1, "data": [1]}', {None, 1007}),
        ('{"type": "setup", "data": {"voice": {"a": 1}}}', {None, 1007}),
        ("\u0000", {None, 1007}),
    ],
    ids=range(10),
)
def test_hostile_messages(attacked: RunningService, path: str, message: object, codes: set[int | None]) -> None:
    assert attack(attacked, path, message) in codes


@pytest.mark.parametrize(
    "raw",
    [
        b"\xff" * 1000,  # reserved bits and an unknown opcode
        b"\x81\x03abc",  # not masked
        b"\x89\xfe\xff\xff" + bytes(70_000),  # a ping of 64 KB
        b"\x81\xff" + struct.pack(">Q", 1 << 62) + bytes(4),  # four exabytes
        b"\x81\x83" + bytes(4) + b"\xff\xfe\xfd",  # no UTF-8
    ],
    ids=range(5),
)
def test_broken_frames_close_the_socket(attacked: RunningService, raw: bytes) -> None:
    assert attack(attacked, "/", raw=raw) in {1002, 1006, 1007, 1009}


def test_a_stream_that_never_begins_ends(attacked: RunningService) -> None:
    async def run() -> str:
        async with websockets.connect(f"{attacked.url.replace('http', 'ws', 1)}/v1/stream") as connection:
            said = await connection.recv()
            with pytest.raises(websockets.ConnectionClosed):
                await connection.recv()
            return str(said)

    assert "did not arrive within 2 s" in asyncio.run(run())


def test_a_flood_of_pings_takes_no_memory(attacked: RunningService) -> None:
    """A client that sends pings and never reads the answers is not read from any more, and then ended."""
    ping = b"\x89\xfd" + bytes(4) + b"p" * 125
    with connect(attacked.url) as connection:
        lines = ["GET / HTTP/1.1", "Host: localhost", "Connection: Upgrade", "Upgrade: websocket"]
        lines += ["Sec-WebSocket-Version: 13", "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==", "", ""]
        connection.sendall("\r\n".join(lines).encode())
        assert connection.recv(65_536).startswith(b"HTTP/1.1 101")
        connection.settimeout(30)
        before, n_sent = resident_bytes(attacked.process.pid), 0
        try:
            while n_sent < 300_000_000:
                n_sent += connection.send(ping * 1000)
        except (ConnectionError, TimeoutError):
            pass
        assert n_sent < 300_000_000
        assert resident_bytes(attacked.process.pid) - before < 50_000_000


def resident_bytes(pid: int) -> int:
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")


def test_too_many_connections_get_503(host: HostService) -> None:
    with host(connections=5, head_s=60, workers=0, is_ready=False) as running:
        held = [connect(running.url) for _ in range(5)]
        answer = ask(running.url, head("GET", "/healthz"))
        assert (answer.status, answer.code, answer.headers["retry-after"]) == (503, "busy", "2")
        for connection in held:
            connection.close()
        eventually(lambda: ask(running.url, head("GET", "/healthz")).status == 200)


@pytest.mark.parametrize("path", PATHS)
def test_sockets_of_other_pages_are_refused_with_a_status(attacked: RunningService, path: str) -> None:
    async def open_socket() -> None:
        address = attacked.url.replace("http", "ws", 1) + path
        async with websockets.connect(address, origin="https://evil.example"):
            pass

    with pytest.raises(websockets.InvalidStatus) as refused:
        asyncio.run(open_socket())
    assert refused.value.response.status_code == 403
    assert b"unknown_origin" in refused.value.response.body
