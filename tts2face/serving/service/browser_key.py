"""The key of a browser: a cookie in place of a header, only for the studio's addresses."""

from collections.abc import Mapping
from http.cookies import CookieError, SimpleCookie

from tts2face.serving.service.exchange import Exchange
from tts2face.serving.service.page_addresses import PAGES, is_page

COOKIE = "tts2face_key"
COOKIE_S = 30 * 86_400


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
