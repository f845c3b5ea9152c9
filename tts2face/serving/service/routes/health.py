"""Health, readiness and metrics."""

import shutil
import tempfile
from typing import Any

from fastapi import APIRouter
from fastapi import Request as HttpRequest
from fastapi.responses import JSONResponse, Response

from tts2face.serving.batch.engine import MIN_FREE_BYTES
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.routes.clips import service_state

router = APIRouter(tags=["operation"])


@router.get("/healthz", summary="Whether the server runs")
def healthz() -> dict[str, str]:
    """The server answers."""
    return {"status": "ok"}


@router.get("/health", summary="Whether the server runs, for clients of Kokoro-FastAPI")
def health() -> dict[str, str]:
    """The server answers."""
    return {"status": "healthy"}


@router.get("/readyz", summary="Whether requests would be served", responses={503: {"description": "Not ready."}})
async def readyz(request: HttpRequest) -> JSONResponse:
    """Processes, disk, database, and whether the server is shutting down; 503 unless all are well."""
    state = service_state(request)
    checks: dict[str, Any] = {
        "models": state.pool.n_ready > 0,
        "disk": shutil.disk_usage(tempfile.gettempdir()).free > MIN_FREE_BYTES,
        "database": await state.jobs.is_reachable(),
        "accepting": not state.is_draining,
    }
    is_ready = all(checks.values())
    return JSONResponse({"status": "ready" if is_ready else "not ready", "checks": checks}, 200 if is_ready else 503)


@router.get("/metrics", response_class=Response, summary="Prometheus metrics")
def metrics(request: HttpRequest) -> Response:
    """Counters and gauges in Prometheus' text format; needs the scope admin."""
    if "admin" not in request.state.key.scopes:
        raise RefusedError(403, "forbidden", "the metrics need a key with the scope admin")
    return Response(service_state(request).metrics.as_text(), media_type="text/plain; version=0.0.4")
