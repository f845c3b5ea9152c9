"""The ASGI application of the service."""

import asyncio
from collections.abc import AsyncIterator, Callable, Iterable, Iterator, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import Any

from fastapi import FastAPI
from fastapi import Request as HttpRequest
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from fastapi.telemetry import TelemetryConfig
from starlette.exceptions import HTTPException
from starlette.routing import Match

from lexicon.errors import Tts2faceError
from tts2face import __version__
from tts2face.serving.service.errors import DOCUMENTED, RefusedError, as_refused, error_body
from tts2face.serving.service.guard import Guard
from tts2face.serving.service.routes import (
    clips,
    headtts,
    health,
    jobs,
    kokoro,
    live,
    openai,
    reference,
    resources,
    results,
)
from tts2face.serving.service.settings import ServiceSettings
from tts2face.serving.service.state import ServiceState

# FastAPI's own telemetry exports addresses and messages of errors, which may hold keys and texts (decision 099).
NO_TELEMETRY: TelemetryConfig = {"tracing": False, "metrics": False, "logs": False, "auto_configure": False}


@dataclass(frozen=True, slots=True)
class Mount:
    """Parts that another room adds to a service.

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
        docs_url=None,
        redoc_url=None,
        description="Text to talking face.",
        responses=DOCUMENTED,
        telemetry=NO_TELEMETRY,
    )
    app.state.service = state
    for part in (openai, kokoro, clips, headtts, live, jobs, results, resources, health, reference):
        app.include_router(part.router)
    app.add_exception_handler(RefusedError, _answer_refused)
    app.add_exception_handler(Tts2faceError, _answer_error)
    app.add_exception_handler(RequestValidationError, _answer_invalid)
    app.add_exception_handler(HTTPException, _answer_http)
    for mount in mounts:
        mount.add(app, state)
    state.metrics.begin_paths({route.path for route in _routes(app.routes)})
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
    # pydantic quotes what was sent, of any length
    message = f"{name}: {first['msg'][:200]}"
    request.state.exchange.code = "invalid_request"
    return JSONResponse(error_body("invalid_request", message, name), 422)


async def _answer_http(request: HttpRequest, error: Exception) -> JSONResponse:
    assert isinstance(error, HTTPException)
    headers = dict(error.headers or {})
    # RFC 9110, 15.5.6: the answer names the methods that there are
    if error.status_code == 405:
        headers["Allow"] = ", ".join(sorted(_methods(request)))
    return JSONResponse(error_body("http", str(error.detail)), error.status_code, headers)


def _methods(request: HttpRequest) -> set[str]:
    """Methods of all routes of a path, of several forms of paths the one with the fewest parameters.

    Starlette names those of one route only.
    """
    routes = [route for route in _routes(request.app.routes) if route.matches(request.scope)[0] != Match.NONE]
    form = min((route.path for route in routes), key=lambda path: path.count("{"), default="")
    found = {method for route in routes if route.path == form for method in getattr(route, "methods", None) or ()}
    return found | {"HEAD"} if "GET" in found else found


def _routes(routes: Iterable[Any]) -> Iterator[Any]:
    """All routes, those of included routers among them, which FastAPI keeps as one."""
    for route in routes:
        # FastAPI keeps an included router as one route
        router = getattr(route, "original_router", None)
        yield from (route,) if router is None else _routes(router.routes)
