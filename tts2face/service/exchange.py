"""A request and its answer: identity, headers, and what the log and the metrics tell."""

import json
import re
import time
import uuid
from collections.abc import Awaitable, Callable, MutableMapping
from typing import Any

from tts2face.service.errors import RefusedError, error_body

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]

REQUEST_ID = re.compile(rb"[A-Za-z0-9._-]{1,64}")
HEADERS = ((b"x-content-type-options", b"nosniff"), (b"cache-control", b"no-store"))
CLOSE_REFUSED = 1008  # WebSocket: policy violation


class Exchange:
    """A request, its identity, and what is known of its answer."""

    def __init__(self, scope: Scope, receive: Receive, send: Send) -> None:
        self.scope, self._receive, self._send = scope, receive, send
        self.headers: dict[bytes, bytes] = dict(scope["headers"])
        given = self.headers.get(b"x-request-id", b"")
        self.id = given.decode() if REQUEST_ID.fullmatch(given) else uuid.uuid4().hex
        self.began = time.monotonic()
        self.status, self.n_bytes = 0, 0
        self.first_byte_s: float | None = None
        self.timing: dict[str, float] = {}  # seconds of stages, for the header Server-Timing

    @property
    def age_s(self) -> float:
        """Seconds since the request arrived."""
        return time.monotonic() - self.began

    async def send(self, message: MutableMapping[str, Any]) -> None:
        """Send a message of the answer with the headers of the service."""
        if message["type"] == "http.response.start":
            self.status = message["status"]
            given = {name for name, _ in message["headers"]}
            message["headers"] = [
                *message["headers"],
                *(header for header in HEADERS if header[0] not in given),
                (b"x-request-id", self.id.encode()),
                (b"server-timing", self._server_timing().encode()),
            ]
        elif message["type"] == "http.response.body":
            self.n_bytes += len(message.get("body", b""))
            if self.first_byte_s is None and message.get("body"):
                self.first_byte_s = time.monotonic() - self.began
        elif message["type"] == "websocket.accept":
            self.status = 101
        elif message["type"] == "websocket.send":
            self.n_bytes += len(message.get("bytes") or message.get("text") or b"")
        await self._send(message)

    async def refuse(self, refused: RefusedError) -> None:
        """Answer with an error, unless an answer has begun."""
        if self.status:
            return
        if self.scope["type"] == "websocket":
            self.status = refused.status
            await self._send({"type": "websocket.close", "code": CLOSE_REFUSED, "reason": refused.message[:120]})
            return
        body = json.dumps(error_body(refused.code, refused.message), ensure_ascii=False).encode()
        headers = [(name.lower().encode(), value.encode()) for name, value in refused.headers.items()]
        headers += [(b"content-type", b"application/json"), (b"content-length", str(len(body)).encode())]
        await self.send({"type": "http.response.start", "status": refused.status, "headers": headers})
        await self.send({"type": "http.response.body", "body": body})

    def _server_timing(self) -> str:
        stages = {**self.timing, "total": time.monotonic() - self.began}
        return ", ".join(f"{name};dur={1000 * seconds:.1f}" for name, seconds in stages.items())
