"""Messages of a client, read ahead of the application within limits of size and time."""

import asyncio
import time
from collections import deque
from collections.abc import Mapping, MutableMapping
from typing import Any

from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.exchange import Exchange, Receive

READ_AHEAD_BYTES = 256 << 10  # of a client that wait for the application; then no more is read


class Incoming:
    """Messages of a client, read ahead of the application, so that its leaving is noticed at once.

    A body has limits of size and time; it is read from the first time that the application asks for it, so that a
    client which waits for ``100 Continue`` sends nothing that is refused. Everything else is read from the start.
    """

    def __init__(self, request: Exchange, receive: Receive, max_bytes: float, max_s: float) -> None:
        self._request, self._receive = request, receive
        self._max_bytes = max_bytes
        self._max_s, self._deadline = max_s, time.monotonic() + max_s
        self._n_bytes, self._has_body = 0, False
        self._messages: deque[MutableMapping[str, Any]] = deque()
        self._n_waiting_bytes = 0  # of the messages
        self._wrong: RefusedError | None = None
        self._changed = asyncio.Event()  # a message has come, has been taken, or the end was reached
        self._reading: asyncio.Task[None] | None = None

    def check(self) -> None:
        """Refuse a body whose stated length is too large; what has none is complete, however late it is asked for."""
        headers = self._request.headers
        length = headers.get(b"content-length", b"0")
        if self._request.scope["type"] == "http":
            self._has_body = length != b"0" or b"transfer-encoding" in headers
            if not length.isdigit() or int(length) > self._max_bytes:
                raise self._too_large()
        if not self._has_body:
            self._start()

    async def receive(self) -> MutableMapping[str, Any]:
        """Next message of the client; again and again the last one, which says that it has left."""
        self._start()
        while not self._messages:
            if self._wrong is not None:
                raise self._wrong
            self._changed.clear()
            await self._changed.wait()
        message = self._messages[0]
        if not _is_last(message):
            self._messages.popleft()
            self._n_waiting_bytes -= _n_bytes(message)
            self._changed.set()
        return message

    def close(self) -> None:
        """Read no more."""
        if self._reading is not None:
            self._reading.cancel()

    def _start(self) -> None:
        if self._reading is None:
            self._reading = asyncio.create_task(self._read())

    async def _read(self) -> None:
        message: MutableMapping[str, Any] = {"type": ""}
        while not _is_last(message):
            try:
                message = await self._next()
            except RefusedError as wrong:
                self._wrong = wrong
            if self._wrong is None:
                self._messages.append(message)
                self._n_waiting_bytes += _n_bytes(message)
            if _is_last(message):
                self._request.leave()
            self._changed.set()
            if self._wrong is not None:
                return
            while self._n_waiting_bytes >= READ_AHEAD_BYTES:
                self._changed.clear()
                await self._changed.wait()

    async def _next(self) -> MutableMapping[str, Any]:
        if not self._has_body:
            return await self._receive()
        try:
            message = await asyncio.wait_for(self._receive(), max(0.0, self._deadline - time.monotonic()))
        except TimeoutError as late:
            raise RefusedError(
                408, "too_slow", f"the body did not arrive within {self._max_s:g} s; send it faster"
            ) from late
        if message["type"] == "http.request":
            self._n_bytes += _n_bytes(message)
            self._has_body = message.get("more_body", False)
            if self._n_bytes > self._max_bytes:
                raise self._too_large()
        return message

    def _too_large(self) -> RefusedError:
        return RefusedError(413, "too_large", f"the body is larger than {self._max_bytes / 1e6:g} MB; send less")


def _is_last(message: Mapping[str, Any]) -> bool:
    return str(message["type"]).endswith(".disconnect")


def _n_bytes(message: Mapping[str, Any]) -> int:
    """Size of what a client has sent; of texts in characters."""
    return len(message.get("body") or message.get("bytes") or message.get("text") or b"")
