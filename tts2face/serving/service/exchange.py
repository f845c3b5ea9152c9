"""A request as its client sends it, and its answer: identity, headers, and what log, metrics and traces receive."""

import asyncio
import json
import re
import time
import uuid
from collections import deque
from collections.abc import Awaitable, Callable, Coroutine, Iterator, Mapping, MutableMapping, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from contextvars import ContextVar, copy_context
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar

from starlette.requests import ClientDisconnect

from tts2face.serving.service.errors import RefusedError, error_body
from tts2face.serving.service.logs import REQUEST_ID
from tts2face.serving.service.page_addresses import is_page, page_headers, subprotocol_of

if TYPE_CHECKING:
    from tts2face.serving.service.keys import ApiKey

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]
REQUEST_ID_FORM = re.compile(rb"[A-Za-z0-9._-]{1,64}")
HEADERS = ((b"x-content-type-options", b"nosniff"), (b"cache-control", b"no-store"))
PROBES = frozenset({"/health", "/healthz", "/readyz", "/metrics"})  # are answered until the end, and not logged
OTHER = "other"  # route of what no route answers
METHODS = frozenset({"GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"})
CLOSE_NORMAL = 1000  # of WebSockets
CLOSE_REFUSED = 1008  # policy violation
CLOSE_RESTART = 1012  # service restart
HTTP_FORM = "websocket.http.response"  # extension of ASGI: a refused WebSocket gets an HTTP answer
CLOSE_S = 1.0  # for which a client may take to read why its answer ends early
ERROR_FIELD = "X-Tts2face-Error"  # trailer of an answer that ends before it is complete, with the JSON of the error
FAIL = "end_incomplete"  # name in the state of a scope: ends an answer with trailers, `HttpConnection.fail`
LEFT = 499  # status, in the log and the metrics only, of a request whose client left before its answer began
READ_AHEAD_BYTES = 256 << 10  # of a client that wait for the application; then no more is read
MAX_STAGES = 200  # of a request that are kept; a WebSocket may have any number
Item = TypeVar("Item")
CLIENT: ContextVar["Exchange | None"] = ContextVar("client", default=None)  # for whose request the present task works
STAGES: ContextVar["list[Stage] | None"] = ContextVar("stages", default=None)


@dataclass(slots=True)
class Stage:
    """A part of the time of a request, such as waiting for a process; its bounds in seconds of the monotonic clock."""

    name: str
    start: float
    end: float | None = None


class Exchange:
    """A request, its identity, and what is known of its answer.

    It is created in the task of the request, whose log lines have its id from then on.
    """

    def __init__(self, scope: Scope, receive: Receive, send: Send) -> None:
        self.scope = scope
        self._receive, self._send = receive, send
        self.headers: dict[bytes, bytes] = dict(scope["headers"])
        self._method = str(scope.get("method", "WS"))
        if self._method == "HEAD":  # is answered as GET is, without the body
            scope["method"] = "GET"
        given = self.headers.get(b"x-request-id", b"")
        self.id = given.decode() if REQUEST_ID_FORM.fullmatch(given) else uuid.uuid4().hex
        self.began = time.monotonic()
        self.status, self.n_bytes = 0, 0
        self.code: str | None = None  # of the error with which it was refused
        self.first_byte_s: float | None = None
        self.stages: list[Stage] = []
        self.further: list[tuple[bytes, bytes]] = []  # headers of its answer, whatever answers it
        self.ending: Callable[[dict[str, Any]], bytes] | None = None  # how an answer that fails ends
        self.key: ApiKey | None = None  # with which it is answered
        self.cut_by: RefusedError | None = None  # why the service ended it before it was complete
        self.is_answered = False  # all of its answer has been passed on
        self.has_left = False  # its client has, before the answer was complete
        self._watched: set[asyncio.Task[Any]] = set()
        self._is_closed = False
        self._task: asyncio.Task[Any] | None = None
        REQUEST_ID.set(self.id)
        STAGES.set(self.stages)

    @property
    def age_s(self) -> float:
        """Seconds since the request arrived."""
        return time.monotonic() - self.began

    @property
    def is_cut(self) -> bool:
        """Whether the service ended it before it was complete."""
        return self.cut_by is not None

    @property
    def method(self) -> str:
        """Method; ``WS`` of a WebSocket, ``OTHER`` if it is none of `METHODS`."""
        method = self._method
        return method if method in METHODS or self.scope["type"] == "websocket" else "OTHER"

    @property
    def route(self) -> str:
        """Path of its route with the names of parameters in place of their values; `OTHER` if there is none."""
        return str(getattr(self.scope.get("route"), "path", OTHER))

    @property
    def is_probed(self) -> bool:
        """Whether it is one of those by which programs look again and again whether the service is well."""
        return self.scope["path"] in PROBES and self.status in {200, 503}

    async def send(self, message: MutableMapping[str, Any]) -> None:
        """Send a message of the answer with the headers of the service."""
        if self._is_closed or (self.has_left and self.scope["type"] == "http"):
            return
        if message["type"] == "http.response.start":
            self.status = message["status"]
            given = {name for name, _ in message["headers"]}
            own = (*HEADERS, *page_headers(self.scope["path"]))
            message["headers"] = [
                *message["headers"],
                *(header for header in own if header[0] not in given),
                *self.further,
                (b"x-request-id", self.id.encode()),
                (b"server-timing", self._server_timing().encode()),
            ]
            if self.method == "HEAD":
                await self._send(message)
                self._is_closed = True
                await self._send({"type": "http.response.body"})
                raise ClientDisconnect  # who wants nothing more
        elif message["type"] == "websocket.accept":
            self.status, message["subprotocol"] = 101, message.get("subprotocol") or subprotocol_of(self.scope)
        elif message["type"] == "websocket.close":
            self._is_closed = True
        elif message["type"] == "http.response.body":
            self.is_answered = not message.get("more_body", False)
        self._count(message)
        await self._send(message)

    async def answer(self, status: int, headers: list[tuple[bytes, bytes]], body: bytes = b"") -> None:
        """Answer it as a whole."""
        lines = headers if status == 204 else [*headers, (b"content-length", str(len(body)).encode())]
        with suppress(ClientDisconnect):
            await self.send({"type": "http.response.start", "status": status, "headers": lines})
            await self.send({"type": "http.response.body", "body": body})

    async def run(self, work: Awaitable[None]) -> None:
        """Run what answers the request, until it ends or until `cut`."""
        self._task = asyncio.current_task()
        try:
            await work
        except asyncio.CancelledError:
            if not self.is_cut:  # cancelled by the server's end, not by us
                raise
        finally:
            task, self._task = self._task, None
            if self.is_cut and task is not None and task.cancelling():  # by `cut`, also where the work has caught it
                task.uncancel()

    def leave(self) -> None:
        """Note that the client has left, and end what is waited for on its behalf."""
        if self.is_answered or self.has_left:
            return
        self.has_left = True
        if not self.status:
            self.status, self.code = LEFT, "left"
        for task in self._watched:
            task.cancel()

    @contextmanager
    def watched(self) -> Iterator[None]:
        """End what the block waits for as soon as the client leaves."""
        if self.has_left:
            raise ClientDisconnect
        task = asyncio.current_task()
        assert task is not None
        self._watched.add(task)
        try:
            yield
        except asyncio.CancelledError:
            if self.has_left and task.uncancel() == 0:  # nobody else has cancelled it
                raise ClientDisconnect from None
            raise
        finally:
            self._watched.discard(task)

    async def refuse(self, refused: RefusedError) -> None:
        """Answer with an error, or end with it an answer that has begun."""
        self.code, content = refused.code, error_body(refused.code, refused.message)
        if self.status:
            return await self._end_incomplete(content)
        body = json.dumps(content).encode()
        headers = [(name.lower().encode(), value.encode("latin-1")) for name, value in refused.headers.items()]
        headers.append((b"content-type", b"application/json"))
        if self.scope["type"] == "http":
            return await self.answer(refused.status, headers, body)
        self.status = refused.status
        if HTTP_FORM not in self.scope.get("extensions", {}):
            # RFC 6455, 5.5: a control frame has at most 125 bytes
            return await self._send({"type": "websocket.close", "code": CLOSE_REFUSED, "reason": refused.message[:120]})
        headers += [(b"content-length", str(len(body)).encode()), (b"x-request-id", self.id.encode()), *self.further]
        await self._send({"type": f"{HTTP_FORM}.start", "status": refused.status, "headers": headers})
        return await self._send({"type": f"{HTTP_FORM}.body", "body": body})

    async def _end_incomplete(self, content: dict[str, Any]) -> None:
        """End an answer that has begun: by a last line or event where its form has them, else by a trailer."""
        if self.scope["type"] != "http" or self.is_answered or self._is_closed or self.has_left:
            return
        if self.ending is not None and (last := self.ending(content)):
            with suppress(TimeoutError):
                await asyncio.wait_for(self.send({"type": "http.response.body", "body": last}), CLOSE_S)
            return
        if (fail := self.scope.get("state", {}).get(FAIL)) is not None:
            accepted = self.headers.get(b"te", b"").lower().replace(b" ", b"").split(b",")
            fail([(ERROR_FIELD.encode(), json.dumps(content).encode())], is_read=b"trailers" in accepted)

    async def announce_end(self, refused: RefusedError) -> None:
        """Write to the client of a WebSocket why the service is about to end it; pages notice it by themselves."""
        if self.scope["type"] == "websocket" and self.status == 101 and not is_page(self.scope["path"]):
            with suppress(OSError, RuntimeError):  # the client has left
                text = json.dumps({"type": "error", "code": refused.code, "message": refused.message})
                await self.send({"type": "websocket.send", "text": text})

    async def close(self, code: int = CLOSE_NORMAL, reason: str = "") -> None:
        """Close a WebSocket that is open."""
        if self.scope["type"] == "websocket" and self.status == 101 and not self._is_closed:
            self._is_closed = True
            with suppress(OSError, RuntimeError):  # the client has left
                await self._send({"type": "websocket.close", "code": code, "reason": reason})

    async def cut(self, refused: RefusedError, code: int = CLOSE_RESTART) -> None:
        """End the request now: a WebSocket with a close code, a stream incomplete, what has no answer yet with one."""
        if self.cut_by is not None:
            return
        self.cut_by, self.code = refused, refused.code
        with suppress(TimeoutError):  # a client that reads nothing is not waited for
            async with asyncio.timeout(CLOSE_S):
                await self.close(code, refused.message[:120])
        if self._task is not None:
            self._task.cancel()

    async def revoke(self, refused: RefusedError) -> None:
        """End the request now, since its key is no longer what it was; the client of a WebSocket gets the reason."""
        with suppress(TimeoutError):
            async with asyncio.timeout(CLOSE_S):
                await self.announce_end(refused)
        await self.cut(refused, CLOSE_REFUSED)

    def _count(self, message: MutableMapping[str, Any]) -> None:
        if message["type"] == "http.response.body":
            content = message.get("body", b"")
        elif message["type"] == "websocket.send":
            content = message.get("bytes") or message.get("text") or b""
        else:
            return
        self.n_bytes += len(content)
        if self.first_byte_s is None and content:
            self.first_byte_s = self.age_s

    def _server_timing(self) -> str:
        now = time.monotonic()
        stages = durations(self.stages, now) | {"total": now - self.began}
        return ", ".join(f"{name};dur={1000 * seconds:.1f}" for name, seconds in stages.items())


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
            while self._n_waiting_bytes >= READ_AHEAD_BYTES:  # then TCP slows the client down
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


def while_client_stays() -> AbstractContextManager[None]:
    """Block whose waiting ends as soon as the client of the present request, if there is one, leaves."""
    client = CLIENT.get()
    return nullcontext() if client is None else client.watched()


def in_background(work: Coroutine[Any, Any, Item]) -> "asyncio.Task[Item]":
    """Task that goes on when the client of the present request leaves."""
    context = copy_context()
    context.run(CLIENT.set, None)
    return asyncio.get_running_loop().create_task(work, context=context)


@contextmanager
def stage(name: str) -> Iterator[None]:
    """Record the time of a block as a stage of the present request; without a request, nothing is recorded."""
    stages, new = STAGES.get(), Stage(name, time.monotonic())
    if stages is not None and len(stages) < MAX_STAGES:
        stages.append(new)
    try:
        yield
    finally:
        new.end = time.monotonic()


def durations(stages: Sequence[Stage], now: float) -> dict[str, float]:
    """Seconds of each name; a stage that has not ended counts up to `now`."""
    found: dict[str, float] = {}
    for spent in stages:
        found[spent.name] = found.get(spent.name, 0.0) + (now if spent.end is None else spent.end) - spent.start
    return found
