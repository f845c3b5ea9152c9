"""The page of puppetry: a camera or a Live Link Face table drives the head; takes of it are kept."""

import tempfile
from pathlib import Path
from typing import Any

from fastapi import Request as HttpRequest
from nicegui import events, ui

from tts2face import __version__
from tts2face.serving.service.keys import ApiKey
from tts2face.serving.service.page_addresses import TAKES
from tts2face.serving.studio.components.puppet import Puppet
from tts2face.serving.studio.components.stage import StageElement
from tts2face.serving.studio.importing import SOUND_SUFFIXES
from tts2face.serving.studio.pages.frame import begin_page, confirm, heading, icon_button, page_bar, shown_errors
from tts2face.serving.studio.pages.styles import ANY_TAKE
from tts2face.serving.studio.recordings import MAX_TAKE_BYTES
from tts2face.serving.studio.studio import Studio
from tts2face.serving.studio.take_store import FILM, READING, SOUND, TABLE, TakeEntry
from tts2face.serving.work.jobs import FAILED

REFRESH_S = 0.5
FILES = "/api/takes"  # below the address of the pages


def register(studio: Studio) -> None:
    """Add the page."""

    @ui.page("/puppet", title="Puppetry - tts2face studio", response_timeout=20.0)
    async def show(request: HttpRequest) -> None:
        begin_page(request)
        for name in ("palette.css", "puppet.css"):
            ui.add_css(Path(__file__).with_name(name).read_text(encoding="utf-8"))
        PuppetPage(studio, request.state.key).build(request)


class PuppetPage:
    """The camera and the takes of a key."""

    def __init__(self, studio: Studio, key: ApiKey) -> None:
        self._studio, self._key = studio, key
        self._takes = studio.takes
        self._shown: object = None
        self._sound_of = ""  # take that gets the next uploaded sound

    def build(self, request: HttpRequest) -> None:
        """Build the page."""
        with page_bar(request, "Puppetry"):
            pass
        with ui.element("div").classes("puppet-page"):
            with ui.element("div").classes("stage"):
                stage = StageElement(f"{TAKES}/face.glb?version={__version__}")
                stage.on("failed", lambda event: ui.notify(str(event.args), type="negative"))
            with ui.element("section").classes("panel").props('aria-label="Camera and takes"'):
                if "build" in self._key.scopes:
                    self._controls()
                else:
                    ui.label(f"The key {self._key.name} lacks the scope build, which takes need; use another key.")

    def _controls(self) -> None:
        self._puppet = Puppet(f"{TAKES}/live", f"{TAKES}/new?name=Take")
        self._puppet.on("sent", self._refresh)
        self._puppet.on("failed", lambda event: ui.notify(str(event.args), type="negative"))
        with ui.element("div").classes("line"):
            heading(2, "Takes")
            ui.element("span").classes("grow")
            upload = self._upload(ANY_TAKE, self._uploaded)
            choose = ui.button("Upload a take", on_click=lambda: upload.run_method("pickFiles")).props("outline dense")
            with choose:
                ui.tooltip("A Live Link Face table (.csv), or a video of one person")
        self._sound_upload = self._upload(",".join(SOUND_SUFFIXES), self._sound_uploaded)
        self._list = ui.element("div")
        self._refresh()
        ui.timer(REFRESH_S, self._refresh)

    def _upload(self, kinds: str, on_upload: Any) -> ui.upload:
        limit = f"{MAX_TAKE_BYTES >> 20} MB"
        upload = ui.upload(
            auto_upload=True, max_file_size=MAX_TAKE_BYTES, on_upload=on_upload,
            on_rejected=lambda: ui.notify(f"The file is refused: give one of {kinds} of at most {limit}.",
                                          type="negative"),
        ).props(f'accept="{kinds}"').style("display: none")  # fmt: skip
        upload.on("finish", upload.reset)
        return upload

    async def _uploaded(self, event: events.UploadEventArguments) -> None:
        with shown_errors(), tempfile.TemporaryDirectory(prefix="tts2face-take-") as folder:
            path, name = Path(folder, "upload"), Path(event.file.name)
            await event.file.save(path)
            await self._takes.add(self._key, path, name.suffix.lower(), name.stem)
        self._refresh()

    async def _sound_uploaded(self, event: events.UploadEventArguments) -> None:
        with shown_errors(), tempfile.TemporaryDirectory(prefix="tts2face-take-") as folder:
            path = Path(folder, "upload")
            await event.file.save(path)
            await self._takes.add_sound(self._key, self._sound_of, path)
            self._puppet.hide(f"{TAKES}/{self._sound_of}/preview")
        self._refresh()

    def _refresh(self) -> None:
        """Show what has changed."""
        entries = self._takes.store.entries(self._key.name)
        rows = []
        for entry in entries:
            work = self._takes.work_on(self._key, entry.id)
            stage = f"{work.stage} {work.done}" if work is not None and work.is_open else ""
            error = work.message if work is not None else ""
            film = (self._takes.store.folder(self._key.name, entry.id) / FILM).is_file()
            rows.append((entry, stage, error, film))
        if rows == self._shown:
            return
        self._shown = rows
        self._list.clear()
        with self._list:
            if not rows:
                ui.label(
                    "There is no take yet. Start the camera and record one, or upload a Live Link Face table (.csv) "
                    "or a video: the head plays it."
                ).classes("note")
            for row, stage, error, film in rows:
                self._row(row, stage, error, has_film=film)

    def _row(self, take: TakeEntry, stage: str, error: str, *, has_film: bool) -> None:
        address, name = f"{FILES}/{take.id}", take.name
        with ui.element("div").classes("take"):
            ui.label(name).style("font-weight: 600; overflow-wrap: anywhere")
            ui.label(_state(take, stage)).classes("quiet")
            if error or take.state == FAILED:
                ui.label(_sentence(error or take.message)).classes("note wrong")
            with ui.element("div").classes("line"):
                if take.state not in {READING, FAILED}:
                    self._actions(take, address, has_film=has_film)
                ui.element("span").classes("grow")
                icon_button("edit", f"Rename {name}", lambda: self._ask_name(take))
                icon_button("delete", f"Delete {name}", lambda: self._ask_delete(take))

    def _actions(self, take: TakeEntry, address: str, *, has_film: bool) -> None:
        name = take.name
        icon_button("play_arrow", f"Play {name}", lambda: self._puppet.show(f"{TAKES}/{take.id}/preview"))
        with icon_button("download", f"Files of {name}"), ui.menu():
            ui.menu_item("Live Link Face table (.csv)", lambda: ui.download(f"{address}/files/{TABLE}"))
            if take.has_sound:
                ui.menu_item("Sound (.wav)", lambda: ui.download(f"{address}/files/{SOUND}"))
            if has_film:
                ui.menu_item("Film (.mp4)", lambda: ui.download(f"{address}/files/{FILM}"))
            else:
                ui.menu_item("Render a film", lambda: self._film(take))
        with icon_button("more_vert", f"More for {name}"), ui.menu():
            ui.menu_item("Make it a style", lambda: self._make_style(take))
            if take.has_sound:
                ui.menu_item("Make a project of its sound", lambda: self._make_project(take))
            ui.menu_item("Add or replace the sound", lambda: self._choose_sound(take))

    def _choose_sound(self, take: TakeEntry) -> None:
        self._sound_of = take.id
        self._sound_upload.run_method("pickFiles")

    async def _film(self, take: TakeEntry) -> None:
        with shown_errors():
            self._takes.film(self._key, take.id)
        self._refresh()

    async def _make_style(self, take: TakeEntry) -> None:
        with shown_errors():
            await self._takes.make_style_take(self._key, take.id)
            ui.navigate.to("/palette")

    async def _make_project(self, take: TakeEntry) -> None:
        with shown_errors():
            ui.navigate.to(f"/animate/{await self._takes.make_project(self._key, take.id)}")

    async def _ask_name(self, take: TakeEntry) -> None:
        with ui.dialog() as dialog, ui.card():
            written = ui.input("New name", value=take.name).props("outlined autofocus maxlength=60")
            with ui.row():
                ui.button("Rename", on_click=lambda: dialog.submit(written.value))
                ui.button("Cancel", on_click=lambda: dialog.submit(None)).props("flat")
        new = await dialog
        dialog.delete()
        if new:
            with shown_errors():
                self._takes.store.rename(self._key.name, take.id, new)
            self._refresh()

    async def _ask_delete(self, take: TakeEntry) -> None:
        async def delete() -> None:
            self._puppet.hide(f"{TAKES}/{take.id}/preview")
            with shown_errors():
                await self._takes.remove(self._key, take.id)
            self._refresh()

        await confirm(
            f"Delete the take {take.name!r} with its sound and film? This cannot be undone.", "Delete", delete
        )


def _state(take: TakeEntry, stage: str) -> str:
    if stage or take.state == READING:
        return stage or "waiting"
    if take.state == FAILED:
        return "cannot be used"
    return f"{take.seconds:.1f} s, {'with' if take.has_sound else 'without'} sound"


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:] + ("" if text.endswith(".") else ".")
