"""A face that is kept compressed, as a page fetches it."""

import asyncio
import gzip
from pathlib import Path

from fastapi import Request as HttpRequest
from fastapi.responses import Response


async def face_answer(request: HttpRequest, path: Path) -> Response:
    """The binary glTF of a file compressed by gzip; decompressed for a program that does not take it so."""
    content = await asyncio.to_thread(path.read_bytes)
    # The address says in its query what is drawn: what it names never changes.
    headers = {"Cache-Control": "private, max-age=31536000, immutable", "Vary": "Accept-Encoding"}
    if "gzip" in request.headers.get("accept-encoding", ""):
        headers["Content-Encoding"] = "gzip"
    else:
        content = gzip.decompress(content)
    return Response(content, media_type="model/gltf-binary", headers=headers)
