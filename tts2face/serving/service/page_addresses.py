"""The studio's pages in a browser: their addresses, headers that keep them within this service, and their keys."""

from collections.abc import Mapping
from http.cookies import CookieError, SimpleCookie
from typing import Any

PAGES = "/studio"
REFERENCE, BROWSER = "/docs", "/browser"
REFERENCE_FILES = ("swagger-ui-bundle.js", "swagger-ui.css", "start.js")
BROWSER_FILES = (  # of the element <tts2face-head>, which pages of other origins import
    "tts2face-head.js", "live_head.js", "live_stream.js", "pushed_sound.js", "sound_clock.js", "curves.js",
    "samples.js", "capture.js", "puppet.js",
)  # fmt: skip
RECORDINGS = f"{PAGES}/api/recordings"
STYLES = f"{PAGES}/api/styles"
TAKES = f"{PAGES}/api/takes"
# NiceGUI has scripts and styles in its pages and compiles templates in the browser (Vue), hence 'unsafe-inline' and
# 'unsafe-eval'. Nothing may come from, or go to, another host: no script, picture, font, frame, form or connection.
POLICY = "; ".join([
    "default-src 'self'", "script-src 'self' 'unsafe-inline' 'unsafe-eval'", "style-src 'self' 'unsafe-inline'",
    "img-src 'self' data: blob:", "font-src 'self' data:", "media-src 'self' blob:", "connect-src 'self' blob: data:",
    "worker-src 'self' blob:", "object-src 'none'", "base-uri 'none'", "form-action 'self'", "frame-ancestors 'none'",
])  # fmt: skip
PAGE_HEADERS = (
    (b"content-security-policy", POLICY.encode()),
    (b"referrer-policy", b"no-referrer"),
    (b"permissions-policy", b"camera=(self), microphone=(self), geolocation=(), usb=()"),
    (b"cross-origin-opener-policy", b"same-origin"),
    (b"cross-origin-resource-policy", b"same-origin"),
)

LOGIN_PATH = f"{PAGES}/login"
STATIC_PATHS = (f"{PAGES}/_nicegui/", f"{PAGES}/_nicegui_ws/")  # libraries of a page, and its connection
COOKIE = "tts2face_key"
COOKIE_S = 30 * 86_400
UPLOADS = f"{PAGES}/_nicegui/client/"
SUBPROTOCOL = "tts2face"  # which a page offers with a WebSocket, beside the one that holds its key


def is_static(path: str) -> bool:
    """Whether an address is that of a page's libraries or of its connection, which no limit of a key counts.

    The connection of an open page is no request that a draining service waits for.
    """
    return path.startswith(STATIC_PATHS) and not path.startswith(UPLOADS)


def is_page(path: str) -> bool:
    """Whether an address belongs to the studio."""
    return path == PAGES or path.startswith(f"{PAGES}/")


def page_headers(path: str) -> tuple[tuple[bytes, bytes], ...]:
    """Further headers of an answer, if its address belongs to the studio."""
    return PAGE_HEADERS if is_page(path) else ()


def cookie_key(headers: Mapping[bytes, bytes]) -> str:
    """Key in the cookie of a request; empty if there is none."""
    cookies: SimpleCookie = SimpleCookie()
    try:
        cookies.load(headers.get(b"cookie", b"").decode("latin-1"))
    except CookieError:
        return ""
    return cookies[COOKIE].value if COOKIE in cookies else ""


def subprotocol_key(scope: Mapping[str, Any]) -> str:
    """Key that a page sends with a WebSocket as a subprotocol, out of its address; empty if there is none."""
    before = f"{SUBPROTOCOL}.key."
    offered = (str(name) for name in scope.get("subprotocols", ()) if name.startswith(before))
    return next(offered, "").removeprefix(before)


def subprotocol_of(scope: Mapping[str, Any]) -> str | None:
    """Subprotocol of a WebSocket: browsers close one of whose subprotocols none is chosen (RFC 6455, 4.1)."""
    return SUBPROTOCOL if SUBPROTOCOL in scope.get("subprotocols", ()) else None


def set_cookie(key: str, *, is_secure: bool) -> str:
    """Header ``Set-Cookie`` that keeps a key, or removes it if it is empty.

    Scripts cannot read it, and no request that another site causes has it.
    """
    age = COOKIE_S if key else 0
    secure = "; Secure" if is_secure else ""
    return f"{COOKIE}={key}; Path={PAGES}; Max-Age={age}; HttpOnly; SameSite=Strict{secure}"
