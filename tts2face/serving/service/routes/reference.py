"""Files for browsers, which need no network: Swagger UI's reference, and the modules of ``<tts2face-head>``."""

import gzip
from functools import cache
from importlib.resources import files

from fastapi import APIRouter
from fastapi import Request as HttpRequest
from fastapi.responses import HTMLResponse, Response

from tts2face.serving.service.page_addresses import BROWSER, BROWSER_FILES, REFERENCE, REFERENCE_FILES

router = APIRouter(include_in_schema=False)

# Swagger UI writes styles into its elements, has pictures in its style sheet, and shows sound and pictures of answers.
POLICY = "; ".join([
    "default-src 'none'", "script-src 'self'", "style-src 'self' 'unsafe-inline'", "img-src 'self' data: blob:",
    "media-src 'self' blob:", "connect-src 'self'", "base-uri 'none'", "form-action 'none'", "frame-ancestors 'none'",
])  # fmt: skip
PAGE = """<!doctype html>
<html lang="en">
<meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>tts2face: reference</title>
<link rel="icon" href="data:,">
<link rel="stylesheet" href="docs/swagger-ui.css">
<div id="reference"></div>
<script src="docs/swagger-ui-bundle.js"></script><script src="docs/start.js"></script>
</html>
"""
CACHE = "private, max-age=86400"


@router.get(REFERENCE)
def show_reference() -> HTMLResponse:
    """The page."""
    return HTMLResponse(PAGE, headers={"Content-Security-Policy": POLICY, "Referrer-Policy": "no-referrer"})


def _add_file(address: str, folder: str, name: str) -> None:
    media_type = "text/css" if name.endswith(".css") else "text/javascript"

    @router.get(f"{address}/{name}")
    def send_file(request: HttpRequest) -> Response:
        content, headers = _compressed(folder, name), {"Cache-Control": CACHE, "Vary": "Accept-Encoding"}
        if "gzip" in request.headers.get("accept-encoding", ""):
            return Response(content, headers=headers | {"Content-Encoding": "gzip"}, media_type=media_type)
        return Response(gzip.decompress(content), headers=headers, media_type=media_type)


@cache
def _compressed(folder: str, name: str) -> bytes:
    here = files("tts2face.serving.service") / folder
    packed = here / f"{name}.gz"
    return packed.read_bytes() if packed.is_file() else gzip.compress((here / name).read_bytes(), mtime=0)


for _name in REFERENCE_FILES:
    _add_file(REFERENCE, "swagger_ui", _name)
for _name in BROWSER_FILES:
    _add_file(BROWSER, "browser", _name)
