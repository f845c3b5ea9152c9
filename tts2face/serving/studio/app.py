"""The studio within the application of the service."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

from fastapi import FastAPI
from nicegui import app as pages_app
from nicegui import ui

from tts2face.serving.service.application import NO_TELEMETRY, Mount
from tts2face.serving.service.page_addresses import PAGES
from tts2face.serving.service.state import ServiceState
from tts2face.serving.studio.pages import animate, login, projects, puppet, reports, styles
from tts2face.serving.studio.pages.record import add_record_page
from tts2face.serving.studio.requests import TASKS
from tts2face.serving.studio.routes import comparing as comparison_routes
from tts2face.serving.studio.routes import projects as projects_routes
from tts2face.serving.studio.routes import reports as report_routes
from tts2face.serving.studio.routes import styles as style_routes
from tts2face.serving.studio.routes import takes as take_routes
from tts2face.serving.studio.studio import Studio

TITLE = "tts2face studio"
RECONNECT_S = 30.0  # for which the state of a page is kept while its connection is away


def mount_studio(app: FastAPI, state: ServiceState) -> None:
    """Add the studio to an application: pages under `PAGES`, what they fetch, and the login."""
    studio = Studio(state)
    app.include_router(login.make_router(state))
    app.state.studio = studio
    for room in (projects_routes, comparison_routes, report_routes, style_routes, take_routes):
        app.include_router(room.router)
    for page in (projects, animate, styles, puppet, reports):
        page.register(studio)
    add_record_page(app, studio.recordings)
    _disable_telemetry()
    pages_app.config.socket_io_js_transports = ["websocket"]
    ui.run_with(
        app, mount_path=PAGES, title=TITLE, language="en-US", dark=None, tailwind=False, reconnect_timeout=RECONNECT_S,
        show_welcome_message=False,
    )  # fmt: skip
    _run_with(app, studio)


STUDIO = Mount(mount_studio, TASKS)


def _run_with(app: FastAPI, studio: Studio) -> None:
    """Go on with the work of an earlier server; save all projects when it ends, while its processes still run."""
    before = app.router.lifespan_context

    @asynccontextmanager
    async def lifespan(whole: FastAPI) -> AsyncIterator[Any]:
        async with before(whole) as state:
            await studio.start()
            try:
                yield state
            finally:
                # a second signal must not cut the writing of projects
                await asyncio.shield(studio.close())

    app.router.lifespan_context = lifespan


def _disable_telemetry() -> None:
    """Switch off FastAPI's telemetry of the pages, as in `tts2face.serving.service.server`."""
    pages_app._telemetry = {**pages_app._telemetry, **NO_TELEMETRY}
    pages_app._native_telemetry = type(pages_app._native_telemetry)(pages_app._telemetry)
