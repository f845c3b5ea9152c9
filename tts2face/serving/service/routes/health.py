"""Health, readiness and metrics."""

from fastapi import APIRouter
from fastapi import Request as HttpRequest
from fastapi.responses import JSONResponse, Response

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
    """Models, folders, database, workers, and whether the server is shutting down; 503 unless all are well.

    ``missing`` says what is not, and what to do; ``preparing``, what synthesis processes that have started do until
    they are ready.
    """
    state = service_state(request)
    draining = "the service is shutting down; ask another server" if state.is_draining else ""
    found = await state.readiness.look() | {"accepting": draining}
    missing = [reason for reason in found.values() if reason]
    checks = {name: not reason for name, reason in found.items()}
    content = {
        "status": "not ready" if missing else "ready", "checks": checks, "missing": missing,
        "preparing": state.pool.preparation.as_json(),
    }  # fmt: skip
    return JSONResponse(content, 503 if missing else 200)


@router.get("/metrics", response_class=Response, summary="Prometheus metrics")
def metrics(request: HttpRequest) -> Response:
    """Counters and gauges in Prometheus' text format; needs the scope admin."""
    if "admin" not in request.state.key.scopes:
        raise RefusedError(403, "forbidden", "the metrics need a key with the scope admin")
    return Response(service_state(request).metrics.as_text(), media_type="text/plain; version=0.0.4")
