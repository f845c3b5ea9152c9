"""The right panel of the page "animate": tools and styles, pronunciation, examples of a phone, notes.

The part of the inspector that explains a phone: its recorded examples, their lips, and which are excluded.

Strips of lips as SVG: outlines of `tts2face.serving.studio.tasks.explain` at the instants of a phone. Pure.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

from nicegui import ui

from tts2face.serving.studio.pages.compare_panel import ComparePanel
from tts2face.serving.studio.pages.frame import OpenPage, heading, shown_errors
from tts2face.serving.studio.routes.projects import explain

MARGIN_MM = 2.0  # around the lips of a cell
UPPER_MID, LOWER_MID = 5, 15  # places of the middles of the lips in an inner outline

Outlines = Sequence[Mapping[str, Sequence[Sequence[float]]]]


@dataclass(frozen=True, slots=True)
class Cell:
    """Place of a pair of lips in a strip: mm from the middle of the mouth to the sides, and to top and bottom."""

    half_width: float
    top: float
    bottom: float


def common_cell(strips: Sequence[Outlines]) -> Cell:
    """Cell that holds the lips of all strips, so that they are drawn at one scale."""
    points = [point for strip in strips for one in strip for point in one["outer"]]
    half = max((abs(x) for x, _ in points), default=1.0) + MARGIN_MM
    heights = [y for _, y in points] or [0.0]
    return Cell(half, min(heights) - MARGIN_MM, max(heights) + MARGIN_MM)


def strip_svg(outlines: Outlines, cell: Cell, whose: str) -> str:
    """Picture of the lips from the first instant to the last, with what it shows in words.

    Parameters
    ----------
    whose
        Start of the words, such as ``Lips of bbaf2n``.
    """
    width, height = 2 * cell.half_width, cell.bottom - cell.top
    gaps = ", ".join(f"{opening_mm(one):.1f}" for one in outlines)
    words = escape(f"{whose}, from its beginning to its end: open by {gaps} mm", quote=True)
    lips = "".join(
        f'<g transform="translate({width * number + cell.half_width:.2f} {-cell.top:.2f})">'
        f'<path class="lips" d="{_path(one["outer"])}"/><path class="mouth" d="{_path(one["inner"])}"/></g>'
        for number, one in enumerate(outlines)
    )
    size = f"{width * len(outlines):.2f} {height:.2f}"
    return f'<svg class="lip-strip" role="img" aria-label="{words}" viewBox="0 0 {size}">{lips}</svg>'


def opening_mm(one: Mapping[str, Sequence[Sequence[float]]]) -> float:
    """Vertical gap between the middles of the inner lips, mm, at least 0."""
    return max(float(one["inner"][LOWER_MID][1] - one["inner"][UPPER_MID][1]), 0.0)


def _path(points: Any) -> str:
    return "M" + "L".join(f"{x:.2f} {y:.2f}" for x, y in points) + "Z"


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
        for one in self._page.workspace.project.excluded:
            with ui.row().style("align-items: center; gap: .25rem"):
                ui.label(f"excluded: {one.utterance} {one.start:.2f} s").classes("quiet")
                self._exclude_button("Use again", one.utterance, one.start, is_excluded=False)

    def _exclude_button(self, text: str, utterance: str, start: float, *, is_excluded: bool) -> None:
        async def change() -> None:
            await self._page.edit({"kind": "exclude", "utterance": utterance, "start": start, "on": is_excluded})
            if self._explained is not None:
                await self.explain(self._explained)

        ui.button(text, on_click=change).props(f'dense flat no-caps aria-label="{escape(text)} {escape(utterance)}"')


def _show_strip(outlines: Outlines, cell: Cell, whose: str) -> None:
    if outlines:
        ui.html(strip_svg(outlines, cell, whose), sanitize=False)


TOOLS = {"select": ("Select", "near_me"), "brush": ("Brush", "brush"), "eraser": ("Eraser", "auto_fix_normal")}


class Inspector:
    """Tools of the timeline, and what is known of what is chosen."""

    def __init__(self, page: OpenPage) -> None:
        self._page = page
        self._tool, self._style = "select", ""
        self._styles: Sequence[Mapping[str, str]] = ()
        self._enabled: list[Any] = []

    def build(self, styles: Sequence[Mapping[str, str]]) -> None:
        """Build the panel."""
        heading(2, "Tools")
        with ui.row().props('role=group aria-label="Tool of the timeline"').style("gap: .25rem"):
            self._tools = {name: self._tool_button(name, *shown) for name, shown in TOOLS.items()}
        heading(2, "Styles")
        self._list = ui.element("div").classes("styles").props('role=group aria-label="Style of the brush"')
        self.set_styles(styles)
        heading(2, "Pronunciation")
        self._word = ui.input("Word").props("dense outlined")
        self._phones = ui.input("Phones", placeholder="T AH0 M EY1 T OW2 or /təmeɪtoʊ/").props("dense outlined")
        self._keep = ui.checkbox("Keep for my new projects")
        with ui.row():
            set_word = ui.button("Set", on_click=self._pronounce).props("dense")
            forget = ui.button("As the dictionary", on_click=lambda: self._pronounce(is_removed=True)).props(
                "dense flat"
            )
        self._own_words = ui.label().classes("quiet")
        self._examples = Examples(self._page)
        self.compare = ComparePanel(self._page)
        heading(2, "Notes")
        self._notes = ui.element("div").props("role=status")
        self._enabled = [self._word, self._phones, self._keep, set_word, forget, self.compare]
        self.refresh()
        self.show_notes()

    def set_styles(self, styles: Sequence[Mapping[str, str]]) -> None:
        """Offer the styles of another palette."""
        self._styles = styles
        if all(one["name"] != self._style for one in styles):
            self._style = styles[0]["name"] if styles else ""
        self._list.clear()
        with self._list:
            for one in styles:
                swatch = ui.element("button").props(f'type=button title="{escape(one["summary"])}"')
                with swatch:
                    ui.element("i").style(f"background: {one['color']}").props("aria-hidden=true")
                    ui.html(escape(one["name"]), sanitize=False, tag="span")
                swatch.on("click", lambda name=one["name"]: self._choose("brush", name))
        self._show_choice()

    def set_enabled(self, is_enabled: bool) -> None:
        """Allow or refuse changes."""
        for control in self._enabled:
            control.set_enabled(is_enabled)

    def refresh(self) -> None:
        """Show the pronunciations of the project."""
        words = self._page.workspace.project.pronunciations
        self._own_words.set_text("; ".join(f"{word}: {phones}" for word, phones in words.items()))

    async def show_item(self, item: Mapping[str, Any]) -> None:
        """Show what a person has chosen on the timeline: a phone is explained, a word may get other phones."""
        if item.get("kind") == "word":
            word = str(item.get("name", "")).strip(".,;:!?\"'()")
            self._word.value = word
            self._phones.value = self._page.workspace.project.pronunciations.get(word, "")
        elif item.get("kind") == "phone":
            await self._examples.explain((float(item["begin"]) + float(item["end"])) / 2)

    def show_notes(self) -> None:
        """Show what is known of the preview."""
        preview = self._page.workspace.preview.current
        self._notes.clear()
        with self._notes:
            if preview.error:
                ui.label(preview.error).classes("note wrong")
            for note in dict.fromkeys(preview.notes):
                ui.label(note).classes("note")
            if not preview.error and not preview.notes:
                ui.label("Nothing to note.").classes("quiet")

    def _tool_button(self, name: str, text: str, icon: str) -> ui.button:
        button = ui.button(text, icon=icon, on_click=lambda: self._choose(name, self._style))
        return button.props(f"dense no-caps id=studio-{name}")

    def _choose(self, tool: str, style: str) -> None:
        self._tool, self._style = tool, style
        self._page.timeline.set_brush(tool, style)
        self._show_choice()

    def _show_choice(self) -> None:
        for name, button in self._tools.items():
            is_chosen = name == self._tool
            button.props(f"aria-pressed={str(is_chosen).lower()}")
            button.props(remove="outline") if is_chosen else button.props("outline")
        for one, swatch in zip(self._styles, self._list.default_slot.children, strict=True):
            is_chosen = self._tool == "brush" and one["name"] == self._style
            swatch.props(f"aria-pressed={str(is_chosen).lower()}")

    async def _pronounce(self, *, is_removed: bool = False) -> None:
        word, phones = (self._word.value or "").strip(), (self._phones.value or "").strip()
        if not word or not (phones or is_removed):
            ui.notify("Give a word and its phones: click a word on the timeline.", type="warning")
            return
        await self._page.edit({
            "kind": "pronounce", "word": word, "phones": "" if is_removed else phones, "keep": bool(self._keep.value),
        })  # fmt: skip
        self.refresh()
