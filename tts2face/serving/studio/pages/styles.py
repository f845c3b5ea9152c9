"""The page of styles: the own and the shipped ones with moving pictures, new ones from a take or by sliders."""

import math
import os
import tempfile
from dataclasses import replace
from html import escape
from pathlib import Path
from urllib.parse import quote

from fastapi import Request as HttpRequest
from nicegui import events, ui

from tts2face.gestures.elements import StyleSpan
from tts2face.gestures.timeline import Timeline
from tts2face.models.palette import FEATURES
from tts2face.request import Request
from tts2face.serving.service.keys import ApiKey
from tts2face.serving.service.page_addresses import STYLES
from tts2face.serving.studio.components.recorder import STYLE as RECORDER_STYLE
from tts2face.serving.studio.components.recorder import Recorder
from tts2face.serving.studio.importing import SAMPLE_TEXT
from tts2face.serving.studio.pages.frame import begin_page, confirm, heading, icon_button, page_bar, shown_errors
from tts2face.serving.studio.pages.mix_panel import MixPanel
from tts2face.serving.studio.palette_store import FILE, SUFFIXES, shipped
from tts2face.serving.studio.recordings import MAX_TAKE_BYTES, REFUSED
from tts2face.serving.studio.studio import Studio
from tts2face.serving.studio.styles import CHECKING, MAKING, named
from tts2face.session import catalogue
from tts2face.session.project import Project

REFRESH_S = 0.4
LONGEST_S = 120.0  # of a recorded take
PROMPT = "Speak for 20 seconds or more in the manner of the style: tell what you did yesterday, or read aloud."
ANY_TAKE = ",".join(sorted(SUFFIXES))


def register(studio: Studio) -> None:
    """Add the page."""

    @ui.page("/palette", title="Styles - tts2face studio", response_timeout=20.0)
    async def show(request: HttpRequest) -> None:
        begin_page(request)
        ui.add_css(RECORDER_STYLE.read_text(encoding="utf-8"))
        ui.add_css(Path(__file__).with_name("palette.css").read_text(encoding="utf-8"))
        PalettePage(studio, request.state.key).build(request)


class PalettePage:
    """The styles of a key."""

    def __init__(self, studio: Studio, key: ApiKey) -> None:
        self._studio, self._key = studio, key
        self._styles = studio.styles
        self._shown: object = None
        self._pictures: dict[str, ui.element] = {}  # of the styles
        self._missing: list[str] = []  # styles whose picture is not made yet

    def build(self, request: HttpRequest) -> None:
        """Build the page."""
        with page_bar(request, "Styles"):
            pass
        with ui.element("div").classes("page-wide") as self._main:
            with ui.element("section").classes("panel").props('aria-label="Palette"'):
                self._head()
                self._cards = ui.element("div").style("display: flex; flex-direction: column; gap: .75rem")
            with ui.element("section").classes("panel").props('aria-label="New style"'):
                with ui.tabs().props("dense no-caps align=justify") as tabs:
                    take, mix = ui.tab("From a take"), ui.tab("By sliders")
                with ui.tab_panels(tabs, value=take).props("animated=false").style("background: transparent"):
                    with ui.tab_panel(take).style("padding: .5rem 0"):
                        self._take_panel()
                    with ui.tab_panel(mix).style("padding: .5rem 0"):
                        self._mix = MixPanel(self._styles, self._key)
                        self._mix.build()
        self._refresh()
        ui.timer(REFRESH_S, self._refresh)

    def _head(self) -> None:
        with ui.element("div").classes("line"):
            heading(2, "Your palette")
            ui.element("span").classes("grow")
            self._pause = icon_button("pause", "Stop the moving pictures", self._toggle_motion)
            self._download = icon_button("download", "Download the palette", lambda: ui.download(f"/api/styles/{FILE}"))

    def _toggle_motion(self) -> None:
        is_still = "still" not in self._main.classes
        self._main.classes(toggle="still")
        name = "Move the pictures" if is_still else "Stop the moving pictures"
        self._pause.props(f'icon={"play_arrow" if is_still else "pause"} aria-label="{name}"')

    def _take_panel(self) -> None:
        if "build" not in self._key.scopes:
            ui.label(f"The key {self._key.name} lacks the scope build, which takes need; use another key.")
            return
        ui.label(
            "A style is the expression, brows, lids, cheeks, gaze and head of one take; it holds no picture and no "
            "sound, and the take is deleted as soon as the style is made."
        ).classes("quiet")
        self._recorder: Recorder | None = None
        self._place = ui.element("div")
        with ui.element("div").classes("line").style("margin: .6rem 0") as self._buttons:
            self._open = ui.button("Record with the webcam", on_click=self._open_recorder)
        upload = ui.upload(
            auto_upload=True, max_file_size=MAX_TAKE_BYTES, on_upload=self._uploaded,
            on_rejected=lambda: ui.notify(f"The file is refused: give one of {ANY_TAKE} of at most "
                                          f"{MAX_TAKE_BYTES >> 20} MB.", type="negative"),
        ).props(f'accept="{ANY_TAKE}"').style("display: none")  # fmt: skip
        upload.on("finish", upload.reset)
        with self._buttons:
            choose = ui.button("Upload a take", on_click=lambda: upload.run_method("pickFiles")).props("outline")
            with choose:
                ui.tooltip("A video, or a Live Link Face table (.csv)")
        self._status = ui.label().props("role=status").classes("note")
        self._bar = ui.linear_progress(value=0, show_value=False).props('aria-label="Progress of the work on the take"')
        self._name = ui.input("Name of the style").props("dense outlined maxlength=40").style("width: 100%")
        with ui.element("div").classes("line"):
            self._make = ui.button("Make the style", on_click=self._make_style)
            self._drop = ui.button("Delete the take", on_click=self._delete_take).props("flat")

    def _open_recorder(self) -> None:
        self._open.set_visibility(False)
        with self._place:
            self._recorder = Recorder([PROMPT], {}, f"{STYLES}/take/", longest=LONGEST_S)
            self._recorder.on("remove", self._delete_take)
        self._shown = None
        self._refresh()

    async def _uploaded(self, event: events.UploadEventArguments) -> None:
        with shown_errors(), tempfile.TemporaryDirectory(prefix="tts2face-take-") as folder:
            path = Path(folder, "upload")
            await event.file.save(path)
            await self._styles.add_take(self._key, path, Path(event.file.name).suffix.lower())
            if not (self._name.value or "").strip():
                self._name.value = Path(event.file.name).stem.replace("_", " ")[:40]
        self._refresh()

    async def _make_style(self) -> None:
        with shown_errors():
            await self._styles.make(self._key, self._name.value or "")
        self._refresh()

    async def _delete_take(self) -> None:
        with shown_errors():
            await self._styles.delete_take(self._key)
        self._refresh()

    def _refresh(self) -> None:
        """Show what has changed."""
        path = self._styles.store.path(self._key.name)
        version = path.stat().st_mtime_ns if path.is_file() else 0
        work = self._styles.take_state(self._key) if "build" in self._key.scopes else None
        now = (version, work and (work.doing, work.stage, work.done, work.state, work.advice))
        if now == self._shown:
            return
        if self._shown is None or self._shown[0] != version:  # type: ignore[index]
            self._show_styles(version)
            self._mix.set_styles()
        self._shown = now
        if work is not None:
            self._show_take()

    def _show_take(self) -> None:
        work, has_take = self._styles.take_state(self._key), self._styles.store.take(self._key.name) is not None
        is_busy = bool(work.doing)
        self._bar.set_visibility(is_busy)
        self._bar.value = work.done / work.of if work.of else 0
        text = work.stage if is_busy else work.advice
        self._status.text = text[:1].upper() + text[1:] + ("" if is_busy or not text else ".")
        self._status.set_visibility(bool(text))
        self._status.classes(toggle="wrong" if (work.state == REFUSED) != ("wrong" in self._status.classes) else None)
        self._make.set_enabled(has_take and not is_busy and work.state != REFUSED)
        self._drop.set_visibility(has_take)
        if self._recorder is not None:
            state = "checking" if work.doing in {CHECKING, MAKING} else work.state
            self._recorder.set_takes({0: {"state": state, "advice": work.advice.rstrip(".")}} if has_take else {})

    def _show_styles(self, version: int) -> None:
        store = self._styles.store
        listed = catalogue.styles(store.base(self._key.name))
        own = [style for style in listed if style.name not in shipped().names]
        self._download.set_visibility(bool(own))
        self._cards.clear()
        self._pictures = {}
        with self._cards:
            if not own:
                ui.label(
                    "You have no own style yet. Record or upload a take on the right, or mix one of those below by "
                    "sliders; it can then be painted on the timeline of your projects like the others."
                ).classes("note")
            with ui.element("div").classes("swatches"):
                for style in own:
                    self._card(style, version, is_own=True)
            heading(2, "Shipped styles")
            with ui.element("div").classes("swatches"):
                for style in listed:
                    if style not in own:
                        self._card(style, version, is_own=False)

        self._missing = [name for name in self._pictures if not store.swatch(self._key.name, name).is_file()]
        if self._missing:
            with self._cards:  # what is on the page: the card with the button that was pressed may be gone
                ui.timer(0.0, lambda: self._draw_pictures(version), once=True)

    async def _draw_pictures(self, version: int) -> None:
        """Show pictures that are not made yet, one after the other."""
        missing = self._missing
        while missing:
            name = missing.pop(0)
            with shown_errors():
                await self._styles.swatch(self._key, name)
            if missing is not self._missing:
                return  # the styles have changed meanwhile
            self._show_picture(name, version)

    def _show_picture(self, name: str, version: int) -> None:
        address = f"{STYLES}/{quote(name, safe='')}/swatch.webp?{version}"
        self._pictures[name].style(f"background-image: url({address})")

    def _card(self, style: catalogue.StyleEntry, version: int, *, is_own: bool) -> None:
        name = style.name
        with ui.element("article").classes("swatch-card" + " own" * is_own):
            picture = ui.element("span").classes("swatch")
            picture.props(f'role=img aria-label="Moving picture of {escape(name)}"')
            self._pictures[name] = picture
            if self._styles.store.swatch(self._key.name, name).is_file():
                self._show_picture(name, version)
            heading(3, name)
            summary = style.summary if style.source is None or not is_own else f"{style.summary}, from {style.source}"
            ui.html(escape(summary), sanitize=False, tag="p").props(f'title="{escape(summary)}"')
            with ui.element("div").classes("line").style("margin-top: auto; gap: 0"):
                icon_button("movie", f"Open {name} in a new project", lambda: self._try(name))
                if is_own:
                    icon_button("edit", f"Rename {name}", lambda: self._ask_name(name))
                    icon_button("delete", f"Delete {name}", lambda: self._ask_delete(name))

    async def _try(self, name: str) -> None:
        with shown_errors():
            spans = tuple(StyleSpan(feature, name, 0.0, math.inf) for feature in FEATURES)
            project = Project(name=name, request=Request(text=SAMPLE_TEXT), timeline=Timeline(spans=spans))
            base = self._styles.store.base(self._key.name)
            if os.sep in base:
                project = replace(project, models=replace(project.models, palette=base))
            number = await self._studio.create(self._key, project)
            ui.navigate.to(f"/animate/{number}")

    async def _ask_name(self, name: str) -> None:
        with ui.dialog() as dialog, ui.card():
            written = ui.input("New name", value=name).props("outlined autofocus maxlength=40")
            with ui.row():
                ui.button("Rename", on_click=lambda: dialog.submit(written.value))
                ui.button("Cancel", on_click=lambda: dialog.submit(None)).props("flat")
        new = await dialog
        dialog.delete()
        if new and new.strip() != name:
            with shown_errors():
                await self._styles.rename(self._key, name, new)
            self._refresh()

    async def _ask_delete(self, name: str) -> None:
        async def delete() -> None:
            with shown_errors():
                await self._styles.remove(self._key, name)
            self._refresh()

        used = await self._styles.users(self._key, name)
        consequence = f" It is removed from {named(used)}, where the default style takes its place." if used else ""
        await confirm(f"Delete the style {name!r}?{consequence} This cannot be undone.", "Delete", delete)
