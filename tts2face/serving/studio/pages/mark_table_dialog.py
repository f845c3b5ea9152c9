"""The dialog of the page "animate" in which a project gets a table of marks of its own."""

import tempfile
from pathlib import Path

from nicegui import events, ui

from lexicon.errors import DataError
from lexicon.mark_table import read_marks_table
from tts2face.serving.studio.mark_tables import MAX_TABLE_BYTES, add_mark_table
from tts2face.serving.studio.pages.frame import file_field, heading, shown_errors
from tts2face.serving.studio.pages.open_page import OpenPage

TITLE = "Table of marks"


class MarkTableDialog:
    """Number of the rows of a project's table, a field for another one, and a button that removes it."""

    def __init__(self, page: OpenPage) -> None:
        self._page = page
        self._open = ui.button(TITLE, on_click=self._show).props("outline dense")
        with ui.dialog().props(f'aria-label="{TITLE}"') as self._dialog, ui.card().classes("photo-dialog"):
            heading(2, TITLE)
            self._about = ui.label().classes("quiet")
            self._file = file_field("Choose a table, or drop it here", ".tsv,.txt", MAX_TABLE_BYTES, self._given)
            self._file.on("finish", self._file.reset)
            with ui.row():
                self._remove = ui.button("Without a table", on_click=lambda: self._change(None)).props("outline")
                ui.button("Close", on_click=self._dialog.close).props("flat")

    def _show(self) -> None:
        self.refresh()
        self._dialog.open()

    def refresh(self) -> None:
        """Show what the project has."""
        path = self._page.workspace.project.request.text_marks
        self._remove.set_visibility(path is not None)
        self._about.text = _rows(path)

    def set_enabled(self, is_enabled: bool) -> None:
        """Allow or refuse changes."""
        self._open.set_enabled(is_enabled)

    async def _given(self, event: events.UploadEventArguments) -> None:
        page = self._page
        with shown_errors(), tempfile.TemporaryDirectory(prefix="tts2face-upload-") as folder:
            path = Path(folder, "upload")
            await event.file.save(path)
            await self._change(await add_mark_table(page.studio, page.workspace, path))

    async def _change(self, path: Path | None) -> None:
        options = {"text_marks": None if path is None else str(path)}
        await self._page.edit({"kind": "request", "options": options})
        self.refresh()


def _rows(path: Path | None) -> str:
    if path is None:
        return "Emoji, tags and actions of your own, with what they show; the page Text of the guide has an example."
    try:
        n_rows = read_marks_table(path).n_own
    except DataError as wrong:
        return str(wrong)
    return f"{n_rows} marks of your own."
