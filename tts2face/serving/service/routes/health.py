"""Health, readiness and metrics."""

import asyncio

from fastapi import APIRouter
from fastapi import Request as HttpRequest
from fastapi.responses import JSONResponse, Response

from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.readiness import FOR_STREAMS
from tts2face.serving.service.state import service_state

router = APIRouter(tags=["operation"])

ACCEPTING = "accepting"  # the check whether the server is not shutting down


@router.get("/healthz", summary="Whether the server runs")
def healthz() -> dict[str, str]:
    """The server answers."""
    return {"status": "ok"}


@router.get("/health", summary="Whether the server runs, for clients of Kokoro-FastAPI")
def health() -> dict[str, str]:
    """The server answers."""
    return {"status": "healthy"}


@router.get("/readyz", summary="Whether streams would be served", responses={503: {"description": "Not ready."}})
async def readyz(request: HttpRequest) -> JSONResponse:
    """200 where streams would be served: models are loaded, folders have room, the server is not shutting down.

    ``checks`` and ``missing`` also say whether jobs would be made: database and workers. ``missing`` says what to do;
    ``preparing``, what synthesis processes that have started do until they are ready.
    """
    state = service_state(request)
    draining = "the service is shutting down; ask another server" if state.is_draining else ""
    found = await state.readiness.check() | {ACCEPTING: draining}
    is_ready = not any(found[name] for name in (*FOR_STREAMS, ACCEPTING))
    content = {
        "status": "ready" if is_ready else "not ready", "checks": {name: not reason for name, reason in found.items()},
        "missing": [reason for reason in found.values() if reason], "preparing": state.pool.preparation.as_json(),
    }  # fmt: skip
    return JSONResponse(content, 200 if is_ready else 503)


@router.get("/metrics", response_class=Response, summary="Prometheus metrics")
async def metrics(request: HttpRequest) -> Response:
    """Counters and gauges in Prometheus' text format; needs the scope admin."""
    if "admin" not in request.state.key.scopes:
        raise RefusedError(403, "forbidden", "the metrics need a key with the scope admin")
    found = service_state(request).metrics
    await found.check()
    return Response(await asyncio.to_thread(found.as_text), media_type="text/plain; version=0.0.4")
