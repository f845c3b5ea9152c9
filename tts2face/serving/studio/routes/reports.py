"""Addresses of reports (docs/studio.md)."""

from typing import Annotated, Any

from fastapi import APIRouter, Body
from fastapi import Request as HttpRequest
from fastapi.responses import FileResponse, Response

from lexicon.errors import InputError
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.studio.reports import Reports
from tts2face.serving.studio.routes.projects import API
from tts2face.serving.studio.work import BackgroundWork

# A report holds names of a user's files and must not act as a page of this origin.
HEADERS = {
    "Cache-Control": "no-store",
    "Content-Security-Policy": "sandbox; default-src 'none'; style-src 'unsafe-inline'; img-src data:",
}

router = APIRouter(prefix=f"{API}/reports", include_in_schema=False)


def _reports(request: HttpRequest) -> Reports:
    reports: Reports = request.app.state.studio.reports
    return reports


def _found(request: HttpRequest, number: str) -> BackgroundWork:
    try:
        return _reports(request).find(request.state.key.name, number)
    except InputError as wrong:
        raise RefusedError(404, "not_found", str(wrong)) from wrong


@router.get("")
async def list_reports(request: HttpRequest) -> list[dict[str, Any]]:
    """Reports of the key, the newest first."""
    return [report_state(report) for report in _reports(request).of_owner(request.state.key.name)]


@router.post("", status_code=202)
async def start_report(
    request: HttpRequest, kind: Annotated[str, Body(max_length=40)], model: Annotated[str, Body(max_length=200)]
) -> dict[str, Any]:
    """Queue a report."""
    request.app.state.studio.check_scope(request.state.key)
    return report_state(await _reports(request).add(request.state.key, kind, model))


@router.get("/{number}/page")
async def show_report(request: HttpRequest, number: str) -> FileResponse:
    """A finished report."""
    path = _reports(request).page(_found(request, number))
    return FileResponse(path, media_type="text/html", headers=HEADERS)


@router.delete("/{number}", status_code=204)
async def remove_report(request: HttpRequest, number: str) -> Response:
    """Cancel a report, or delete it."""
    request.app.state.studio.work.remove(_found(request, number))
    return Response(status_code=204)


def report_state(report: BackgroundWork) -> dict[str, Any]:
    """JSON of a report."""
    return {
        "id": report.id, **report.content, "created": report.created, "state": report.state,
        "stage": report.stage, "share": round(report.share, 4), "message": report.message,
    }  # fmt: skip
