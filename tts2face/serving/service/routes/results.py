"""Results of jobs by the hash of their content."""

import re
from typing import Annotated, Any

from fastapi import APIRouter, Header, Path
from fastapi import Request as HttpRequest
from fastapi.responses import FileResponse, Response

from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.job_views import HASH
from tts2face.serving.service.state import service_state
from tts2face.serving.work.client import JobClient
from tts2face.serving.work.jobs import JobFile

router = APIRouter(prefix="/v1", tags=["jobs"])

SHA256 = re.compile(r"[0-9a-f]{64}")
RANGE = re.compile(r"(?P<first>\d{1,18})-(?P<last>\d{0,18})|(?P<suffix>-\d{1,18})")
CACHE = "private, max-age=31536000, immutable"
ANSWERS: dict[int | str, dict[str, Any]] = {
    200: {"content": {"application/octet-stream": {}}, "description": "The file, with its media type."},
    206: {"content": {"application/octet-stream": {}}, "description": "The part named by Range."},
    304: {"description": "The file is the one of If-None-Match."},
    404: {"description": "No job of the key has this result."},
    416: {"description": "Range lies beyond the file."},
}


@router.get("/results/{sha256}", response_class=Response, summary="Fetch a result", responses=ANSWERS)
async def fetch_result(
    request: HttpRequest,
    sha256: Annotated[str, Path(description="Hash of the file, from the results of a job.", examples=[HASH])],
    if_none_match: Annotated[
        str | None, Header(description="ETags that the client has.", examples=[f'"{HASH}"'])
    ] = None,
) -> Response:
    """A file that a job of the key has made; its content never changes. Parts of it by `Range`."""
    key = request.state.key
    owner = None if "admin" in key.scopes else key.name
    jobs, found = service_state(request).jobs, None
    if SHA256.fullmatch(sha256):
        found = await jobs.call(lambda client: client.table.file_of(sha256, owner))
    if found is None:
        raise RefusedError(404, "not_found", f"there is no result {sha256[:70]!r}; the job lists its results")
    headers = {"ETag": f'"{sha256}"', "Cache-Control": CACHE}
    if if_none_match is not None and _matches(if_none_match, sha256):
        return Response(status_code=304, headers=headers)
    path = await jobs.call(lambda client: _fetch(client, found))
    # RFC 9110, 14.2: a Range that is none is ignored
    if not _names_ranges(request.headers.get("range", "")):
        request.scope["headers"] = [header for header in request.scope["headers"] if header[0] != b"range"]
    return FileResponse(path, headers=headers, media_type=found.media_type, filename=found.name)


def _names_ranges(header: str) -> bool:
    """Whether a header Range has a valid form; any other one is ignored (RFC 9110, 14.2)."""
    unit, _, listed = header.partition("=")
    ranges = [RANGE.fullmatch(part.strip()) for part in listed.split(",")]
    return unit.strip().lower() == "bytes" and all(
        match is not None and (match["suffix"] or not match["last"] or int(match["first"]) <= int(match["last"]))
        for match in ranges
    )


def _fetch(client: JobClient, found: JobFile) -> str:
    return str(client.blobs.fetch(found.sha256))


def _matches(header: str, sha256: str) -> bool:
    """Whether a header If-None-Match names a hash."""
    tags = {tag.strip().removeprefix("W/") for tag in header.split(",")}
    return "*" in tags or f'"{sha256}"' in tags
