"""The page with the projects of a person: new ones, and those that exist."""

import tempfile
import time
from pathlib import Path

from fastapi import Request as HttpRequest
from nicegui import events, ui

from tts2face.interchange.subtitles.formats import SUFFIXES
from tts2face.serving.service.keys import ApiKey
from tts2face.serving.studio.importing import (
    SOUND_SUFFIXES,
    TEXT_SUFFIXES,
    ImportChoices,
    import_file,
    import_sample,
    import_text,
)
from tts2face.serving.studio.pages.frame import (
    begin_page,
    confirm,
    file_field,
    heading,
    icon_button,
    page_bar,
    shown_errors,
)
from tts2face.serving.studio.pages.login import LOGOUT_PATH
from tts2face.serving.studio.project_archive import has_files
from tts2face.serving.studio.project_store import ProjectEntry
from tts2face.serving.studio.studio import Studio
from tts2face.serving.work.resources import MB

MAX_NOTES = 12  # of a file, that a dialog shows
ANY_FILE = ",".join((*TEXT_SUFFIXES, *SUFFIXES, *SOUND_SUFFIXES, ".json"))


def register(studio: Studio) -> None:
    """Add the page."""

    @ui.page("/", title="Projects - tts2face studio")
    async def show(request: HttpRequest) -> None:
        begin_page(request)
        await ProjectsPage(studio, request.state.key).build(request)


class ProjectsPage:
    """The list of projects of a key, and the ways to make a new one."""

    def __init__(self, studio: Studio, key: ApiKey) -> None:
        self._studio, self._key = studio, key
        self._client = ui.context.client

    async def build(self, request: HttpRequest) -> None:
        """Build the page."""
        self._studio.prepare()
        with page_bar(request, "tts2face studio"):
            if not self._studio.state.keys.is_open:
                ui.html(
                    f'<form method="post" action="{LOGOUT_PATH}"><button type="submit">Log out</button></form>',
                    sanitize=False,
                )
        with ui.element("div").classes("projects"):
            self._new()
            with ui.element("section").classes("panel"):
                heading(2, "Projects")
                self._list = ui.element("div")
        await self._refresh()

    def _new(self) -> None:
        with ui.element("section").classes("panel"):
            heading(2, "New project")
            text = ui.textarea("Text to speak", placeholder="Hello there. What shall I say?").props("outlined autogrow")
            with ui.row():
                ui.button("Create from text", on_click=lambda: self._from_text(text.value or ""))
                ui.button("Open the example", on_click=self._sample).props("outline")
            with ui.expansion("Import a recording, subtitles, a text file or a project").props("dense"):
                ui.label(
                    "A recording is followed by the lips; give its words below before the upload if you know them, as "
                    "the lips are then most accurate. Subtitles and text files are spoken."
                ).classes("quiet")
                self._words = (
                    ui.textarea("Words of the recording (optional)").props("outlined autogrow").style("width: 100%")
                )
                limit = int(self._studio.state.settings.body_mb * MB)
                upload = file_field("Choose a file, or drop it here", ANY_FILE, limit, self._imported)
                upload.on("finish", upload.reset)

    async def _from_text(self, text: str) -> None:
        with shown_errors():
            if not text.strip():
                ui.notify("Write something to say first.", type="warning")
                return
            self._open(await import_text(self._studio, self._key, text))

    async def _sample(self) -> None:
        with shown_errors():
            self._open(await import_sample(self._studio, self._key))

    async def _imported(self, event: events.UploadEventArguments) -> None:
        with shown_errors(), tempfile.TemporaryDirectory(prefix="tts2face-upload-") as folder:
            path = Path(folder, "upload")
            await event.file.save(path)
            choices = ImportChoices(self._words.value or "")
            made = await import_file(self._studio, self._key, path, event.file.name, choices)
            if made.notes:
                await self._show_notes(made.notes)
            self._open(made.project)

    async def _show_notes(self, notes: tuple[str, ...]) -> None:
        """Show what was guessed of a file and is not spoken, before its project opens."""
        with ui.dialog() as dialog, ui.card():
            ui.label("What was found in the file")
            for note in notes[:MAX_NOTES]:
                ui.label(note).classes("quiet")
            if len(notes) > MAX_NOTES:
                ui.label(f"and {len(notes) - MAX_NOTES} more").classes("quiet")
            ui.button("Open the project", on_click=lambda: dialog.submit(None)).props("autofocus")
        await dialog
        dialog.delete()

    def _open(self, number: str) -> None:
        ui.navigate.to(f"/animate/{number}")

    async def _refresh(self) -> None:
        entries = await self._studio.entries(self._key)
        self._list.clear()
        with self._list:
            if not entries:
                ui.label(
                    "There is no project yet. Write a text above, or open the example: it plays at once, and every "
                    "change can be undone."
                )
            for entry in entries:
                self._row(entry)

    def _row(self, entry: ProjectEntry) -> None:
        with ui.element("div").classes("project"):
            with ui.element("div").classes("grow"):
                ui.link(entry.name, f"/animate/{entry.id}").classes("open")
                changed = time.strftime("%Y-%m-%d %H:%M", time.localtime(entry.changed))
                ui.label(f"changed {changed}, {_size(entry.n_bytes)}").classes("quiet")
            icon_button("download", f"Download {entry.name} as a project file", lambda: self._download(entry))
            icon_button("delete", f"Delete {entry.name}", lambda: self._ask_delete(entry))

    async def _download(self, entry: ProjectEntry) -> None:
        with shown_errors():
            project = (await self._studio.open(self._key, entry.id)).project
            ui.download(f"/api/projects/{entry.id}/project.{'zip' if has_files(project) else 'json'}")  # below `PAGES`

    async def _ask_delete(self, entry: ProjectEntry) -> None:
        async def delete() -> None:
            with shown_errors():
                await self._studio.remove(self._key, entry.id)
            await self._refresh()

        question = f"Delete the project {entry.name!r} with its recordings and rendered files? This cannot be undone."
        await confirm(question, "Delete", delete)


def _size(n_bytes: int) -> str:
    return f"{n_bytes / MB:.1f} MB" if n_bytes >= MB / 10 else f"{max(n_bytes / 1000, 1):.0f} kB"
