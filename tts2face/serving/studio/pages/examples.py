"""The part of the inspector that explains a phone: its recorded examples, their lips, and which are excluded."""

from collections.abc import Mapping
from html import escape
from typing import Any

from nicegui import ui

from tts2face.serving.studio.pages.frame import heading, shown_errors
from tts2face.serving.studio.pages.lip_strips import Cell, Outlines, common_cell, strip_svg
from tts2face.serving.studio.pages.open_page import OpenPage
from tts2face.serving.studio.routes.projects import explain

N_SHOWN = 6  # examples of a phone
NOW = 'import("tts2face-studio/clock.js").then((m) => emit(m.clock.time))'
NO_OUTLINES = "This talker keeps no outlines of its recorded lips, so that there are none to show."
NO_EXAMPLE = "No example is used here: it is a pause, an h, or a recording whose words are unknown."


class Examples:
    """The examples of the phone that was explained last."""

    def __init__(self, page: OpenPage) -> None:
        self._page = page
        self._explained: float | None = None
        heading(2, "Explain")
        button = ui.button("The phone at the playhead").props("dense outline")
        button.on("click", lambda event: self.explain(float(event.args)), js_handler=f"() => {NOW}")
        self._shown = ui.element("div")
        with self._shown:
            ui.label("Shows from which recorded examples the lips of a phone are made.").classes("quiet")

    async def explain(self, time: float) -> None:
        """Explain the phone at a time."""
        page = self._page
        self._explained = time
        with shown_errors():
            found = (await explain(page.studio, page.workspace, time))["phone"]
            self._shown.clear()
            with self._shown:
                self._show_phone(found)

    def _show_phone(self, phone: Mapping[str, Any] | None) -> None:
        if phone is None:
            ui.label(NO_EXAMPLE).classes("quiet")
        else:
            shown = "" if phone["shown"] == phone["phone"] else f", shown by {phone['shown']}"
            around = f"{' '.join(phone['left'])} [{phone['phone']}] {' '.join(phone['right'])}"
            ui.label(f"{around}{shown}, {phone['start']:.2f}-{phone['end']:.2f} s")
            tokens = phone["tokens"][:N_SHOWN]
            cell = common_cell([phone["made"], *(token["outlines"] for token in tokens)])
            if phone["made"]:
                ui.label("Lips as they are made, from beginning to end").classes("quiet")
                _show_strip(phone["made"], cell, f"Lips made for {phone['phone']}")
            if not any(token["outlines"] for token in tokens):
                ui.label(NO_OUTLINES).classes("quiet")
            with ui.element("ul").classes("example-list").props('aria-label="Recorded examples, best first"'):
                for token in tokens:
                    self._show_token(phone, token, cell)
        self._show_excluded()

    def _show_token(self, phone: Mapping[str, Any], token: Mapping[str, Any], cell: Cell) -> None:
        around = f"{' '.join(token['left'])} [{phone['shown']}] {' '.join(token['right'])}"
        name = f"{token['utterance']} {token['start']:.2f} s"
        with ui.element("li"):
            _show_strip(token["outlines"], cell, f"Lips of {name}")
            with ui.element("div").classes("example-line"):
                for text in (name, f"score {token['score']:.2f}"):
                    ui.html(escape(text), sanitize=False, tag="span")
            with ui.element("div").classes("example-line"):
                ui.html(escape(around), sanitize=False, tag="span").classes("quiet")
                self._exclude_button("Exclude", token["utterance"], token["start"], is_excluded=True)

    def _show_excluded(self) -> None:
        for token in self._page.workspace.project.excluded:
            with ui.row().style("align-items: center; gap: .25rem"):
                ui.label(f"excluded: {token.utterance} {token.start:.2f} s").classes("quiet")
                self._exclude_button("Use again", token.utterance, token.start, is_excluded=False)

    def _exclude_button(self, text: str, utterance: str, start: float, *, is_excluded: bool) -> None:
        async def change() -> None:
            await self._page.edit({"kind": "exclude", "utterance": utterance, "start": start, "on": is_excluded})
            if self._explained is not None:
                await self.explain(self._explained)

        ui.button(text, on_click=change).props(f'dense flat no-caps aria-label="{escape(text)} {escape(utterance)}"')


def _show_strip(outlines: Outlines, cell: Cell, whose: str) -> None:
    if outlines:
        ui.html(strip_svg(outlines, cell, whose), sanitize=False)
