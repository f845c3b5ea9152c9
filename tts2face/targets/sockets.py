"""Connections to WebSocket servers of targets."""

from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager
from typing import Any

from tts2face.targets.target import TargetLostError

OPEN_S = 10.0  # within which a server must answer
CLOSE_S = 1.0
MAX_ANSWER_BYTES = 1 << 20


@asynccontextmanager
async def connected(url: str, headers: Mapping[str, str] | None = None) -> AsyncIterator[Any]:
    """A connection to a server, which is closed behind the block; a refusal or an end is a `TargetLostError`."""
    from websockets.asyncio.client import connect
    from websockets.exceptions import ConnectionClosed, WebSocketException

    try:
        async with connect(
            url, compression=None, open_timeout=OPEN_S, close_timeout=CLOSE_S, max_size=MAX_ANSWER_BYTES, proxy=None,
            additional_headers=headers,
        ) as socket:  # fmt: skip
            yield socket
    except ConnectionClosed as closed:
        raise TargetLostError("it has closed the connection") from closed
    except WebSocketException as refused:
        raise TargetLostError(f"it refuses the connection: {refused}") from refused
