"""Connections with limits: number, size and time of a request's head, and clients that take nothing of an answer."""

import asyncio
import json
from collections.abc import Sequence
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Any

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

from tts2face.serving.service.errors import error_body
from tts2face.serving.service.exchange import FAIL
from tts2face.serving.service.settings import ServiceSettings

if TYPE_CHECKING:
    from collections.abc import Callable


LINGER_S, LINGER_BYTES = 2.0, 8 << 20  # in which the rest of a refused body is read, so that its answer is read
PIPELINED_BYTES = 64 << 10  # of further requests that wait until the present one is answered
READ_BYTES = 8 << 10  # 2000 of the smallest frames, which take 10 ms
REASONS = {
    400: "Bad Request",
    408: "Request Timeout",
    431: "Request Header Fields Too Large",
    503: "Service Unavailable",
}
# seconds until a connection may be free
RETRY_S = 2


class _Timer:
    """A call after some seconds; starting it again replaces it."""

    def __init__(self, call: "Callable[[], None]") -> None:
        self._call = call
        self._handle: asyncio.TimerHandle | None = None

    def start(self, seconds: float) -> None:
        self.stop()
        self._handle = asyncio.get_running_loop().call_later(seconds, self._call)

    def stop(self) -> None:
        if self._handle is not None:
            self._handle.cancel()
            self._handle = None

    @property
    def is_running(self) -> bool:
        return self._handle is not None


class HttpConnection(H11Protocol):
    """A connection of HTTP/1.1 with the limits of the settings.

    Every request's head must arrive within `head_s`. What a client does not read of an answer within `stall_s` ends the
    connection. Of the rest of the body of a request that is answered already, `LINGER_BYTES` are read in `LINGER_S`.
    """

    def __init__(self, settings: ServiceSettings, **options: Any) -> None:
        super().__init__(**options)
        self._settings = settings
        self._head, self._stall = _Timer(self._end_slow_head), _Timer(self._abort)
        self._linger, self._n_lingering = _Timer(self._abort), 0
        self.app_state = {**self.app_state, FAIL: self.fail}

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Count the connection, and wait for a head."""
        super().connection_made(transport)
        if len(self.connections) > self._settings.connections:
            self._refuse(503, "busy", f"{len(self.connections)} connections are open already; repeat the request later")
        else:
            self._head.start(self._settings.head_s)

    def connection_lost(self, exc: Exception | None) -> None:
        """Stop all timers."""
        for timer in (self._head, self._stall, self._linger):
            timer.stop()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Read a part of a request."""
        if self.transport.is_closing():
            return
        if self._linger.is_running:
            self._n_lingering += len(data)
            if self._n_lingering > LINGER_BYTES:
                return self._abort()
        super().data_received(data)
        is_answered = self.cycle is not None and self.cycle.response_complete
        if not is_answered or self.conn.their_state is not h11.SEND_BODY:
            self._linger.stop()  # the rest has come
        if self.conn.their_state is h11.DONE and len(self.conn.trailing_data[0]) < PIPELINED_BYTES:
            self.flow.resume_reading()  # of a client that has sent a part of its next request: its leaving is noticed
        if self.conn.their_state is not h11.IDLE:
            self._head.stop()
        elif not self._head.is_running and self.conn.trailing_data[0]:
            self._head.start(self._settings.head_s)

    def on_response_complete(self) -> None:
        """Wait for the next request, or for the rest of this one."""
        super().on_response_complete()
        self._linger.stop()
        self._n_lingering = 0
        # a client that still sends when the connection closes gets a reset, and not the answer
        if self.conn.their_state is h11.SEND_BODY and not self.transport.is_closing():
            self._linger.start(LINGER_S)

    def fail(self, fields: Sequence[tuple[bytes, bytes]], *, is_read: bool) -> None:
        """End the present answer, which is incomplete, with trailer fields, and close.

        Only a client that reads trailers (``TE: trailers``) gets the end of the message; for all others it is missing,
        so that they do not take the answer for complete.
        """
        if self.transport.is_closing():
            return
        # an answer of a stated length cannot have trailers
        with suppress(h11.LocalProtocolError):  # of a stated length, or for a client of HTTP/1.0: without trailers
            end = self.conn.send(h11.EndOfMessage(headers=list(fields)))
            self.transport.write(end if is_read else end.removesuffix(b"\r\n"))
        self.cycle.response_complete = True
        self.transport.close()

    def pause_writing(self) -> None:
        """Begin to wait for a client that does not read."""
        super().pause_writing()
        self._stall.start(self._settings.stall_s)

    def resume_writing(self) -> None:
        """Continue, as the client reads."""
        self._stall.stop()
        super().resume_writing()

    def handle_websocket_upgrade(self, event: h11.Request) -> None:
        """Leave the connection to `SocketConnection`."""
        self._head.stop()
        super().handle_websocket_upgrade(event)

    def send_400_response(self, msg: str) -> None:
        """Answer to what is no HTTP."""
        is_large = len(self.conn.trailing_data[0]) > 1024 * self._settings.head_kb
        if is_large:
            self._refuse(431, "too_large", f"the head of the request is larger than {self._settings.head_kb} KB")
        else:
            self._refuse(400, "invalid_request", "this is no valid HTTP request")

    def _end_slow_head(self) -> None:
        if self.conn.trailing_data[0]:
            self._refuse(408, "too_slow", f"the head did not arrive within {self._settings.head_s:g} s; send it faster")
        else:
            self.transport.close()

    def _refuse(self, status: int, code: str, message: str) -> None:
        """Answer without the application, and close."""
        if self.cycle is None or self.cycle.response_complete or not self.cycle.response_started:
            self.transport.write(_answer(status, code, message))
        self.transport.close()

    def _abort(self) -> None:
        self.transport.abort()


class SocketConnection(WebSocketsSansIOProtocol):
    """A WebSocket whose client must read within `stall_s`; nothing is read from it while it does not.

    `READ_BYTES` at most are read in one step of the event loop.
    """

    def __init__(self, settings: ServiceSettings, **options: Any) -> None:
        super().__init__(**options)
        self._settings, self._stall = settings, _Timer(self._abort)

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Read in small parts from now on."""
        super().connection_made(transport)
        transport.max_size = READ_BYTES  # type: ignore[attr-defined]  # of asyncio's transports: bytes of one read

    def keepalive_timeout(self) -> None:
        """End a connection that does not answer a ping, unless its answer may be among what is not read now."""
        if self.read_paused:
            self.pong_timer = self.pending_ping_payload = None
            self.schedule_ping()
        else:
            super().keepalive_timeout()

    def connection_lost(self, exc: Exception | None) -> None:
        """Stop the timer."""
        self._stall.stop()
        super().connection_lost(exc)

    def pause_writing(self) -> None:
        """Begin to wait for a client that does not read; its pings are not answered meanwhile."""
        super().pause_writing()
        self.transport.pause_reading()
        self._stall.start(self._settings.stall_s)

    def resume_writing(self) -> None:
        """Continue, as the client reads."""
        self._stall.stop()
        super().resume_writing()
        # reading stopped when the client did not read (a WebSocket's ping ends no such client)
        if not self.read_paused and not self.transport.is_closing():
            self.transport.resume_reading()

    def _abort(self) -> None:
        self.transport.abort()


def connection_classes(settings: ServiceSettings) -> "tuple[Callable[..., Any], Callable[..., Any]]":
    """Makers of HTTP connections and WebSockets for `uvicorn.Config`."""
    return partial(HttpConnection, settings), partial(SocketConnection, settings)


def _answer(status: int, code: str, message: str) -> bytes:
    body = json.dumps(error_body(code, message)).encode()
    head = [f"HTTP/1.1 {status} {REASONS[status]}", "content-type: application/json", f"content-length: {len(body)}"]
    head += ["connection: close"] + ([f"retry-after: {RETRY_S}"] if status == 503 else [])
    return "\r\n".join([*head, "", ""]).encode() + body
