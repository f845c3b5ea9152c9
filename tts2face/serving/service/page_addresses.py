"""The studio's pages in a browser: their addresses, headers that keep them within this service, and a cookie as key."""

from collections.abc import Mapping
from http.cookies import CookieError, SimpleCookie

PAGES = "/studio"
REFERENCE = "/docs"
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


def set_cookie(key: str, *, is_secure: bool) -> str:
    """Header ``Set-Cookie`` that keeps a key, or removes it if it is empty.

    Scripts cannot read it, and no request that another site causes has it.
    """
    age = COOKIE_S if key else 0
    secure = "; Secure" if is_secure else ""
    return f"{COOKIE}={key}; Path={PAGES}; Max-Age={age}; HttpOnly; SameSite=Strict{secure}"
