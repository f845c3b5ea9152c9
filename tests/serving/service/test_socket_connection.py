"""How WebSockets are read: in small parts, and pings of clients that are not read from."""

import asyncio
from types import SimpleNamespace
from typing import Any

import pytest
from uvicorn import Config
from uvicorn.server import ServerState

from tts2face.serving.service.connections import READ_BYTES, SocketConnection
from tts2face.serving.service.settings import ServiceSettings


class Transport(asyncio.Transport):
    """Records what is done to a connection."""

    def __init__(self) -> None:
        super().__init__()
        self.max_size, self.is_closed = 1 << 18, False

    def get_extra_info(self, name: str, default: Any = None) -> Any:
        return default

    def is_closing(self) -> bool:
        return self.is_closed

    def close(self) -> None:
        self.is_closed = True

    def write(self, data: Any) -> None:
        pass


def opened() -> tuple[SocketConnection, Transport]:
    connection = SocketConnection(
        ServiceSettings(), config=Config(lambda: None), server_state=ServerState(), app_state={}
    )  # fmt: skip
    transport = Transport()
    connection.connection_made(transport)
    return connection, transport


def test_a_step_reads_a_small_part() -> None:
    async def run() -> int:
        return opened()[1].max_size

    assert asyncio.run(run()) == READ_BYTES


def test_a_client_that_is_not_read_from_need_not_answer_a_ping(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its answer may be among what waits; one that is read from is ended."""

    async def run() -> list[bool]:
        found = []
        for is_paused in (True, False):
            connection, transport = opened()
            connection.conn = SimpleNamespace(fail=lambda *_: None, data_to_send=list)  # type: ignore[assignment]
            connection.read_paused = is_paused
            connection.keepalive_timeout()
            found.append(transport.is_closed)
            connection.stop_keepalive()
        return found

    assert asyncio.run(run()) == [False, True]
