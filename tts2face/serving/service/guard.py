"""Checks of every request before any work: host, origin, key, limits; headers, log and metrics of every answer.

Browsers as clients: a cookie in place of a header with the key, only for the studio's addresses.

What a key may do.
"""

import asyncio
import re
import time
from collections import deque
from collections.abc import Awaitable, Callable, Mapping, MutableMapping
from http.cookies import CookieError, SimpleCookie
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qs, urlsplit

from fastapi import Request as HttpRequest
from starlette.requests import ClientDisconnect
from starlette.websockets import WebSocketDisconnect

from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.exchange import (
    CLIENT,
    PAGES,
    PROBES,
    RECORDINGS,
    REFERENCE,
    STYLES,
    TAKES,
    Exchange,
    Receive,
    Scope,
    Send,
    draining,
    is_page,
)
from tts2face.serving.service.keys import NOBODY, ApiKey
from tts2face.serving.service.origins import answer_headers, check_origin, preflight_headers
from tts2face.storage.files import is_disk_full

if TYPE_CHECKING:
    from tts2face.serving.service.exchange import Exchange
    from tts2face.serving.service.state import ServiceState


__all__ = ["COOKIE", "LOGIN_PATH", "cookie_key", "is_page", "is_static", "set_cookie", "wants_login"]

COOKIE = "tts2face_key"
LOGIN_PATH = f"{PAGES}/login"
STATIC_PATHS = (f"{PAGES}/_nicegui/", f"{PAGES}/_nicegui_ws/")  # libraries of a page, and its connection
UPLOADS = f"{PAGES}/_nicegui/client/"
COOKIE_S = 30 * 86_400
BEARER = re.compile(r"^bearer\s+", re.IGNORECASE)  # names of schemes have no case: RFC 9110, 11.1


def is_static(path: str) -> bool:
    """Whether an address is that of a page's libraries or of its connection, which no limit of a key counts.

    The connection of an open page is no request that a draining service waits for.
    """
    return path.startswith(STATIC_PATHS) and not path.startswith(UPLOADS)


def cookie_key(headers: Mapping[bytes, bytes]) -> str:
    """Key in the cookie of a request; empty if there is none."""
    cookies: SimpleCookie = SimpleCookie()
    try:
        cookies.load(headers.get(b"cookie", b"").decode("latin-1"))
    except CookieError:
        return ""
    return cookies[COOKIE].value if COOKIE in cookies else ""


def set_cookie(key: str, *, is_secure: bool) -> str:
    """Header ``Set-Cookie`` that keeps a key, or removes it if it is empty.

    Scripts cannot read it, and no request that another site causes has it.
    """
    age = COOKIE_S if key else 0
    secure = "; Secure" if is_secure else ""
    return f"{COOKIE}={key}; Path={PAGES}; Max-Age={age}; HttpOnly; SameSite=Strict{secure}"


def wants_login(request: "Exchange") -> bool:
    """Whether a request without a key is that of a person who opens a page."""
    wants_page = b"text/html" in request.headers.get(b"accept", b"")
    return request.scope["type"] == "http" and request.method == "GET" and is_page(request.scope["path"]) and wants_page


App = Callable[[Scope, Receive, Send], Awaitable[None]]

RETRY_S = 30  # for clients, while a disk is full
OPEN_PATHS = frozenset({
    *(PROBES - {"/metrics"}), "/openapi.json", REFERENCE,
    *(f"{REFERENCE}/{name}" for name in ("swagger-ui-bundle.js", "swagger-ui.css", "start.js")),
})  # fmt: skip
UNCOUNTED_PATHS = frozenset({*OPEN_PATHS, *PROBES, "/v1/hello"})
VIDEO_PATH = "/v1/talkers/build"
VIDEO_PUTS = (f"{RECORDINGS}/", f"{STYLES}/", f"{TAKES}/")
CLOSE = {"Connection": "close"}
READ_AHEAD_BYTES = 256 << 10  # of a client that wait for the application; then no more is read


class Guard:
    """ASGI middleware of the whole service."""

    def __init__(self, app: App, state: "ServiceState") -> None:
        self._app, self._state = app, state

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Check a request, pass it on, and record its answer."""
        if scope["type"] not in {"http", "websocket"}:
            return await self._app(scope, receive, send)
        request = Exchange(scope, receive, send)
        request.further = answer_headers(request.headers, self._state.settings.origins)
        is_counted = scope["path"] not in UNCOUNTED_PATHS and not is_static(scope["path"])
        try:
            self._check_head(request)
            self._check_host(request)
            if allowed := preflight_headers(request.method, request.headers, self._state.settings.origins):
                await request.answer(204, allowed)
                return self._state.record(request)
            self._check_draining(scope["path"])
            key = request.key = self._identify(request)
            scope["state"] = {**scope.get("state", {}), "key": key, "exchange": request}
            if is_counted:
                self._state.limits.begin(key)
        except RefusedError as refused:
            await request.refuse(refused)
            return self._state.record(request)
        self._state.exchanges.add(request)
        if is_counted:
            self._state.running.add(request)
            CLIENT.set(request)
        try:
            await request.run(self._answer(request, receive))
            await request.close()
            if request.cut_by is not None:
                await request.refuse(request.cut_by)
        finally:
            self._state.exchanges.discard(request)
            if is_counted:
                self._state.running.discard(request)
                self._state.limits.end(key)
            self._state.record(request)
        return None

    async def _answer(self, request: Exchange, receive: Receive) -> None:
        settings, scope = self._state.settings, request.scope
        size = settings.video_mb if _brings_video(scope) else settings.body_mb
        longest_s = settings.body_s * max(1.0, size / settings.body_mb)
        incoming = _Incoming(request, receive, size * 1e6, longest_s)
        try:
            incoming.check()
            await self._app(scope, incoming.receive, request.send)
        except RefusedError as refused:
            await request.refuse(refused)
        except (ClientDisconnect, WebSocketDisconnect):
            pass  # the client has left
        except Exception as defect:  # noqa: BLE001 - the one place where a defect becomes an answer
            if isinstance(defect.__cause__, RefusedError) and request.status:  # Starlette's, of one that comes too late
                await request.refuse(defect.__cause__)
                return
            if is_disk_full(defect):
                message = "a disk of the service is full, /readyz names its folder; repeat the request later"
                await request.refuse(RefusedError(503, "unavailable", message, {"Retry-After": str(RETRY_S)}))
                return
            self._state.note_defect(defect)
            message = f"internal error: {type(defect).__name__}; the log has it under the id {request.id}"
            await request.refuse(RefusedError(500, "internal", message))
        finally:
            incoming.close()

    def _check_draining(self, path: str) -> None:
        if self._state.is_draining and path not in PROBES:
            raise draining()

    def _check_head(self, request: "Exchange") -> None:
        """Refuse heads that are too large, and bodies with two lengths, which proxies may divide differently."""
        settings, scope, given = self._state.settings, request.scope, request.scope["headers"]
        size = sum(len(name) + len(value) for name, value in given)
        size += len(scope.get("raw_path") or b"") + len(scope["query_string"])
        if len(given) > settings.headers or size > 1024 * settings.head_kb:
            message = f"the head has more than {settings.headers} headers or {settings.head_kb} KB; send less"
            raise RefusedError(431, "too_large", message, CLOSE)
        if {b"transfer-encoding", b"content-length"} <= set(request.headers):
            raise RefusedError(400, "invalid_request", "the body has two lengths; send one of them", CLOSE)

    def _check_host(self, request: "Exchange") -> None:
        """Refuse names of other hosts (DNS rebinding) and pages of other origins."""
        host = request.headers.get(b"host", b"").decode("latin-1")
        name = _host_name(host)
        if name not in self._state.settings.allowed_hosts:
            raise RefusedError(
                421, "unknown_host", f"the host {name!r} is none of this service; add it to the setting hosts"
            )
        check_origin(request.headers, self._state.settings.origins)

    def _identify(self, request: "Exchange") -> ApiKey:
        path = request.scope["path"]
        if path in OPEN_PATHS or path == LOGIN_PATH:
            return NOBODY
        given = BEARER.sub("", request.headers.get(b"authorization", b"").decode("latin-1").strip())
        given = given or request.headers.get(b"x-api-key", b"").decode("latin-1")
        if not given and request.scope["type"] == "websocket":  # a browser cannot send headers with it
            given = parse_qs(request.scope["query_string"].decode("latin-1")).get("key", [""])[0]
        if not given and is_page(path):
            given = cookie_key(request.headers)
        try:
            return self._state.keys.find(given)
        except RefusedError as refused:
            if wants_login(request):
                raise RefusedError(303, refused.code, refused.message, {"Location": LOGIN_PATH}) from refused
            raise


def _brings_video(scope: Scope) -> bool:
    """Whether a request brings a recording of a person: only such bodies may be larger than all others."""
    if scope["type"] != "http" or "build" not in scope["state"]["key"].scopes:
        return False
    is_take = scope["method"] == "PUT" and scope["path"].startswith(VIDEO_PUTS)
    return is_take or (scope["method"], scope["path"]) == ("POST", VIDEO_PATH)


def _host_name(host: str) -> str:
    """Name of a Host header without its port; empty if it is none."""
    try:
        return urlsplit(f"//{host}").hostname or ""
    except ValueError:
        return ""


class _Incoming:
    """What a client sends, read ahead of the application, so that its leaving is noticed at once.

    A body has limits of size and time; it is read from the first time that the application asks for it, so that a
    client which waits for ``100 Continue`` sends nothing that is refused. Everything else is read from the start.
    """

    def __init__(self, request: Exchange, receive: Receive, max_bytes: float, max_s: float) -> None:
        self._request, self._receive, self._max_bytes = request, receive, max_bytes
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


def require_scope(request: HttpRequest, scope: str, what: str) -> ApiKey:
    """Key of a request, which must have a scope; `what` names in the plural what needs it.

    Raises
    ------
    RefusedError
        The key does not have the scope.
    """
    key: ApiKey = request.state.key
    if scope not in key.scopes:
        raise RefusedError(403, "forbidden", f"{what} need a key with the scope {scope}; this one has none such")
    return key
