"""Checks of every request before any work: host, origin, key, limits; headers, log and metrics of every answer."""

import re
from collections.abc import Awaitable, Callable
from typing import TYPE_CHECKING
from urllib.parse import parse_qs, urlsplit

from starlette.requests import ClientDisconnect
from starlette.websockets import WebSocketDisconnect

from tts2face.serving.service.errors import RefusedError, draining
from tts2face.serving.service.exchange import CLIENT, PROBES, Exchange, Incoming, Receive, Scope, Send
from tts2face.serving.service.keys import NOBODY, ApiKey
from tts2face.serving.service.origins import answer_headers, check_origin, preflight_headers
from tts2face.serving.service.page_addresses import (
    BROWSER,
    BROWSER_FILES,
    LOGIN_PATH,
    RECORDINGS,
    REFERENCE,
    REFERENCE_FILES,
    STYLES,
    TAKES,
    cookie_key,
    is_page,
    is_static,
    subprotocol_key,
)
from tts2face.storage.files import is_disk_full

if TYPE_CHECKING:
    from tts2face.serving.service.state import ServiceState

BEARER = re.compile(r"^bearer\s+", re.IGNORECASE)  # names of schemes have no case: RFC 9110, 11.1
App = Callable[[Scope, Receive, Send], Awaitable[None]]
RETRY_S = 30  # for clients, while a disk is full
OPEN_PATHS = frozenset({
    *(PROBES - {"/metrics"}), "/openapi.json", REFERENCE,
    *(f"{REFERENCE}/{name}" for name in REFERENCE_FILES), *(f"{BROWSER}/{name}" for name in BROWSER_FILES),
})  # fmt: skip
UNCOUNTED_PATHS = frozenset({*OPEN_PATHS, *PROBES, "/v1/hello"})
VIDEO_PATH = "/v1/talkers/build"
VIDEO_PUTS = (f"{RECORDINGS}/", f"{STYLES}/", f"{TAKES}/")
CLOSE = {"Connection": "close"}


class Guard:
    """ASGI middleware of the whole service."""

    def __init__(self, app: App, state: "ServiceState") -> None:
        self._app, self._state = app, state

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Check a request, pass it on, and record its answer."""
        # "lifespan": start and end of the application
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
        incoming = Incoming(request, receive, size * 1e6, longest_s)
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
        # balancers must learn from /readyz that it drains (decision 100)
        if self._state.is_draining and path not in PROBES:
            raise draining()

    def _check_head(self, request: "Exchange") -> None:
        """Refuse heads that are too large, and bodies with two lengths, which proxies may divide differently."""
        settings, scope = self._state.settings, request.scope
        given = scope["headers"]
        size = sum(len(name) + len(value) for name, value in given)
        size += len(scope.get("raw_path") or b"") + len(scope["query_string"])
        if len(given) > settings.headers or size > 1024 * settings.head_kb:
            message = f"the head has more than {settings.headers} headers or {settings.head_kb} KB; send less"
            raise RefusedError(431, "too_large", message, CLOSE)
        # request smuggling (RFC 9112, 6.3)
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
            given = (
                subprotocol_key(request.scope)
                or parse_qs(request.scope["query_string"].decode("latin-1")).get("key", [""])[0]
            )
        # pages of the studio have logged in by a cookie
        if not given and is_page(path):
            given = cookie_key(request.headers)
        try:
            return self._state.keys.find(given)
        except RefusedError as refused:
            if _wants_login(request):
                raise RefusedError(303, refused.code, refused.message, {"Location": LOGIN_PATH}) from refused
            raise


def _wants_login(request: Exchange) -> bool:
    """Whether a request without a key is that of a person who opens a page."""
    wants_page = b"text/html" in request.headers.get(b"accept", b"")
    return request.scope["type"] == "http" and request.method == "GET" and is_page(request.scope["path"]) and wants_page


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
