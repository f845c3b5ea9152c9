"""A face that is kept compressed, as a page fetches it."""

import asyncio
import gzip
from pathlib import Path

from fastapi import Request as HttpRequest
from fastapi.responses import Response


async def face_answer(request: HttpRequest, path: Path, *, is_named: bool = True) -> Response:
    """The binary glTF of a file compressed by gzip; decompressed for a program that does not take it so.

    Parameters
    ----------
    is_named
        Whether the query of the address says what is drawn: then the answer never changes, and a browser keeps it.
    """
    content = await asyncio.to_thread(path.read_bytes)
    headers = {"Vary": "Accept-Encoding"}
    if is_named:
        headers["Cache-Control"] = "private, max-age=31536000, immutable"
    # it is kept compressed: nothing is packed for each page
    if "gzip" in request.headers.get("accept-encoding", ""):
        headers["Content-Encoding"] = "gzip"
    else:
        content = gzip.decompress(content)
    return Response(content, media_type="model/gltf-binary", headers=headers)
