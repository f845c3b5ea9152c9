"""The right panel of the page "animate": tools and styles, pronunciation, examples of a phone, notes."""

from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

from nicegui import ui

from tts2face.serving.studio.pages.compare_panel import ComparePanel
from tts2face.serving.studio.pages.examples import Examples
from tts2face.serving.studio.pages.frame import heading
from tts2face.serving.studio.pages.open_page import OpenPage

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
        if all(style["name"] != self._style for style in styles):
            self._style = styles[0]["name"] if styles else ""
        self._list.clear()
        with self._list:
            for style in styles:
                swatch = ui.element("button").props(f'type=button title="{escape(style["summary"])}"')
                with swatch:
                    ui.element("i").style(f"background: {style['color']}").props("aria-hidden=true")
                    ui.html(escape(style["name"]), sanitize=False, tag="span")
                swatch.on("click", lambda name=style["name"]: self._choose("brush", name))
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
        for style, swatch in zip(self._styles, self._list.default_slot.children, strict=True):
            is_chosen = self._tool == "brush" and style["name"] == self._style
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
