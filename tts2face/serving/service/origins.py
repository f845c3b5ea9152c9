"""Pages of other origins as clients: which of them may use the service, and the headers that tell browsers so (CORS).

Keys come in headers that the scripts of a page set, never as credentials of the browser: no answer allows those.
Source: the Fetch standard, "HTTP CORS protocol".
"""

from collections.abc import Mapping, Sequence

from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.exchange import METHODS

HeaderLines = list[tuple[bytes, bytes]]

OTHER_SITES = frozenset({"cross-site", "same-site"})  # Sec-Fetch-Site: W3C Fetch Metadata
PAGE = "document"  # Sec-Fetch-Dest of what a browser shows in place of the page before, as after a link
MAX_AGE_S = 600  # for which a browser need not ask again; Chromium keeps at most 7200
EXPOSED = (  # headers of answers that scripts of other origins may read
    "X-Request-ID", "Server-Timing", "Retry-After", "Location", "ETag", "Accept-Ranges", "Content-Range",
    "Content-Disposition", "X-Tts2face-Adjusted", "X-Download-Path",
)  # fmt: skip


def check_origin(headers: Mapping[bytes, bytes], origins: Sequence[str]) -> None:
    """Check that the page of a request, if one sends it, is the service's own or of one of some origins.

    A request without ``Origin`` comes from no page, unless a browser says that another site has caused it, as by a
    picture or a script of that site; only what opens a page of the service in place of the other one may come so.
    """
    origin = _value(headers, b"origin")
    if b"origin" in headers:
        if origin not in origins and origin.partition("://")[1:] != ("://", _value(headers, b"host")):
            raise _refused(repr(origin[:80]))
    # a link on another page may open ours
    elif _value(headers, b"sec-fetch-site") in OTHER_SITES and _value(headers, b"sec-fetch-dest") != PAGE:
        raise _refused("other origins")


def _refused(pages: str) -> RefusedError:
    return RefusedError(
        403, "unknown_origin", f"pages of {pages} may not use this service; add it to the setting origins"
    )


def answer_headers(headers: Mapping[bytes, bytes], origins: Sequence[str]) -> HeaderLines:
    """Headers of every answer, refusals too: a cache keeps apart what differs by origin."""
    if not origins:
        return []
    lines = [(b"vary", b"Origin")]
    if _value(headers, b"origin") in origins:
        # never "*": the key that comes with a request makes it one of that page alone
        lines.append((b"access-control-allow-origin", headers[b"origin"]))
        lines.append((b"access-control-expose-headers", ", ".join(EXPOSED).encode()))
    return lines


def preflight_headers(method: str, headers: Mapping[bytes, bytes], origins: Sequence[str]) -> HeaderLines:
    """Headers that allow the request about which a browser asks first, whose key comes with it; empty: it is none.

    Any header is allowed: clients send their own (``x-stainless-os``), and the service checks those that it reads.
    """
    asked = headers.get(b"access-control-request-method")
    if method != "OPTIONS" or asked is None or _value(headers, b"origin") not in origins:
        return []
    lines = [
        (b"access-control-allow-methods", ", ".join(sorted(METHODS)).encode()),
        (b"access-control-max-age", str(MAX_AGE_S).encode()),
        (b"vary", b"Access-Control-Request-Headers, Access-Control-Request-Private-Network"),
    ]
    if names := headers.get(b"access-control-request-headers"):
        lines.append((b"access-control-allow-headers", names))
    if headers.get(b"access-control-request-private-network") == b"true":  # a public page, a service on this machine
        lines.append((b"access-control-allow-private-network", b"true"))
    return lines


def _value(headers: Mapping[bytes, bytes], name: bytes) -> str:
    return headers.get(name, b"").decode("latin-1")
