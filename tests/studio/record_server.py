"""A server with the recording pages alone: ``python -m tests.studio.record_server FOLDER PORT``."""

import sys
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import uvicorn
from fastapi import FastAPI
from nicegui import ui

from tts2face.studio.pages.record import add_record_page


def make_app(folder: Path) -> FastAPI:
    """The pages as the studio mounts them, for one user."""

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        recordings.checks.start()
        yield
        await recordings.stop()

    app = FastAPI(lifespan=lifespan)
    recordings = add_record_page(app, folder, lambda request: "local")
    ui.run_with(app, mount_path="/studio", tailwind=False, language="en-US", show_welcome_message=False)
    return app


if __name__ == "__main__":
    uvicorn.run(make_app(Path(sys.argv[1])), host="127.0.0.1", port=int(sys.argv[2]), log_level="warning")
