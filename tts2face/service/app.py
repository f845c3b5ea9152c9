"""The ASGI application of the service."""

import asyncio
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass

from fastapi import FastAPI
from fastapi import Request as HttpRequest
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from fastapi.telemetry import TelemetryConfig
from starlette.exceptions import HTTPException
from starlette.routing import Match

from lexicon.errors import Tts2faceError
from tts2face import __version__
from tts2face.service.access.guard import Guard
from tts2face.service.errors import DOCUMENTED, RefusedError, as_refused, error_body
from tts2face.service.routes import clips, headtts, health, jobs, live, openai_speech, resources, results
from tts2face.service.settings import ServiceSettings
from tts2face.service.state import ServiceState

# FastAPI's own telemetry exports addresses and messages of errors, which may hold keys and texts (decision 099).
NO_TELEMETRY: TelemetryConfig = {"tracing": False, "metrics": False, "logs": False, "auto_configure": False}


@dataclass(frozen=True, slots=True)
class Mount:
    """What another room adds to a service.

    Parameters
    ----------
    add
        Adds its parts to the application, behind the same checks.
    tasks
        ``module:NAME`` of its tables of tasks of the synthesis processes.
    """

    add: Callable[[FastAPI, ServiceState], None]
    tasks: tuple[str, ...]


def create_app(settings: ServiceSettings, mounts: Sequence[Mount] = ()) -> FastAPI:
    """Application with the given settings; its synthesis processes run from startup to shutdown."""
    state = ServiceState(settings, tuple(table for mount in mounts for table in mount.tasks))

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        state.pool.start()
        state.jobs.start()
        try:
            yield
        finally:
            await state.jobs.close()
            await state.pool.close()
            state.library.close()
            if state.tracing is not None:
                await asyncio.to_thread(state.tracing.close)

    app = FastAPI(
        title="tts2face",
        version=__version__,
        lifespan=lifespan,
        redoc_url=None,
        description="Text to talking face.",
        responses=DOCUMENTED,
        telemetry=NO_TELEMETRY,
    )
    app.state.service = state
    for part in (openai_speech, clips, headtts, live, jobs, results, resources, health):
        app.include_router(part.router)
    app.add_exception_handler(RefusedError, _answer_refused)
    app.add_exception_handler(Tts2faceError, _answer_error)
    app.add_exception_handler(RequestValidationError, _answer_invalid)
    app.add_exception_handler(HTTPException, _answer_http)
    for mount in mounts:
        mount.add(app, state)
    app.add_middleware(Guard, state=state)
    return app


async def _answer_error(request: HttpRequest, error: Exception) -> JSONResponse:
    assert isinstance(error, Tts2faceError)
    return await _answer_refused(request, as_refused(error))


async def _answer_refused(request: HttpRequest, error: Exception) -> JSONResponse:
    assert isinstance(error, RefusedError)
    request.state.exchange.code = error.code
    return JSONResponse(error_body(error.code, error.message), error.status, error.headers)


async def _answer_invalid(request: HttpRequest, error: Exception) -> JSONResponse:
    assert isinstance(error, RequestValidationError)
    first = error.errors()[0]
    name = ".".join(str(part) for part in first["loc"] if part != "body") or "body"
    message = f"{name}: {first['msg'][:200]}"
    request.state.exchange.code = "invalid_request"
    return JSONResponse(error_body("invalid_request", message, name), 422)


async def _answer_http(request: HttpRequest, error: Exception) -> JSONResponse:
    assert isinstance(error, HTTPException)
    headers = dict(error.headers or {})
    if error.status_code == 405:
        headers["Allow"] = ", ".join(sorted(_methods(request)))
    return JSONResponse(error_body("http", str(error.detail)), error.status_code, headers)


def _methods(request: HttpRequest) -> set[str]:
    """Methods of all routes of a path; Starlette names those of the first one only."""
    routes = (one for one in request.app.routes if one.matches(request.scope)[0] != Match.NONE)
    return {method for one in routes for method in getattr(one, "methods", None) or ()}
