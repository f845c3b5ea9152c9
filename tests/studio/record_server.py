"""A server with the recording pages alone: ``python -m tests.studio.record_server FOLDER PORT``."""

import sys
from pathlib import Path

from nicegui import ui

from tts2face.studio.pages.record import add_record_page


class OwnStudio:
    """A studio of one user."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def owner(self, request: object) -> str:
        return "local"


if __name__ == "__main__":
    add_record_page(OwnStudio(Path(sys.argv[1])))
    ui.run(
        host="127.0.0.1", port=int(sys.argv[2]), show=False, reload=False, title="studio", show_welcome_message=False
    )
