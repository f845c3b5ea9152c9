"""Addresses of the studio's pages, and headers that keep them within this service."""

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
