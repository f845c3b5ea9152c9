"""The left panel of the page "animate": what is said, by which voice, and which head shows it."""

import os
from typing import Any

from nicegui import ui

from tts2face.request import GESTURES, OWN_FACE, Recorded
from tts2face.serving.studio.pages import character_dialog
from tts2face.serving.studio.pages.choices import appearance, languages, models, style_options, styles, voices
from tts2face.serving.studio.pages.frame import heading
from tts2face.serving.studio.pages.mark_table_dialog import MarkTableDialog
from tts2face.serving.studio.pages.open_page import OpenPage
from tts2face.serving.studio.pages.photo_dialog import TITLE, PhotoDialog, may_make_faces
from tts2face.serving.work.resource_check import FACE, PALETTE, TALKER
from tts2face.source_options import MARKUPS

APPEARANCE = {"identity": "Identity", "hair": "Hair", "hair_color": "Hair colour"}  # of a face, with their labels
TYPING_MS = 350  # of rest after which a text is spoken


class SpeechPanel:
    """Controls of a project's request and models."""

    def __init__(self, page: OpenPage) -> None:
        self._page = page
        self._controls: dict[str, Any] = {}  # by name of the option

    async def build(self) -> None:
        """Build the panel."""
        page, project = self._page, self._page.workspace.project
        library, key = page.studio.state.library, page.workspace.key
        is_recording = isinstance(project.request.source, Recorded)
        heading(2, "Speech")
        text = ui.textarea("Words of the recording" if is_recording else "Text", value=project.request.source.text)
        text.props(f'outlined autogrow debounce={TYPING_MS} input-style="max-height: 40vh"')
        text.on_value_change(lambda event: self._change("request", "text", event.value or ""))
        text.on(
            "keydown.ctrl.enter", lambda event: page.speak(str(event.args)), js_handler="(e) => emit(e.target.value)"
        )
        self._controls["text"] = text
        self._select("request", "markup", "Marks in the text", {name: name for name in MARKUPS})
        self._marks = MarkTableDialog(page)
        if not is_recording:
            self._select("request", "voice", "Voice", voices())
            self._slider("rate", "Rate", 0.5, 2.0, 0.05)
            self._slider("voice_pitch", "Pitch", -12.0, 12.0, 0.5)
            self._slider("voice_range", "Range of pitch", 0.0, 2.0, 0.05)
        self._select("request", "language", "Language", languages(), with_filter=True)
        heading(2, "Head")
        found = await self._models()
        for kind in (TALKER, FACE):
            self._select("models", kind, kind.capitalize(), found[kind])
        if character_dialog.may_add_faces(page):
            characters = character_dialog.CharacterDialog(page, self._show_made)
            ui.button(character_dialog.TITLE, on_click=characters.open).props("outline dense")
        if may_make_faces(page):
            dialog = PhotoDialog(page, self._show_made)
            ui.button(TITLE, on_click=dialog.open).props("outline dense")
        offered = await appearance(library, key, project.models.face)
        for name, label in APPEARANCE.items():
            self._select("models", name, label, offered[name])
        heading(2, "Gestures")
        self._select("models", PALETTE, PALETTE.capitalize(), found[PALETTE])
        self._select("request", "style", "Style", await self._styles())
        self._select("request", "gestures", "Method", {name: name for name in GESTURES})

    def refresh(self) -> None:
        """Show the project as it is now."""
        for name in self._controls:
            self._show(name)

    async def show_models(self) -> None:
        """Offer the models that there are now: another tab may have made one."""
        for kind, options in (await self._models()).items():
            value = self._value(kind)
            self._controls[kind].set_options({value: value, **options}, value=value)

    async def _show_made(self, face: str) -> None:
        """Show a face that was made just now."""
        await self.show_models()
        await self._change("models", FACE, face)
        self._show(FACE)

    async def show_appearance(self) -> None:
        """Offer the identities and the hair of the present face, and the styles of the palette."""
        page = self._page
        offered = await appearance(page.studio.state.library, page.workspace.key, page.workspace.project.models.face)
        offered["style"] = await self._styles()
        for name, options in offered.items():
            value = self._value(name)
            self._controls[name].set_options({value: value, **options}, value=value)

    async def _styles(self) -> dict[str, str]:
        """Styles that a whole clip may have."""
        page = self._page
        palette = page.workspace.project.models.palette
        return style_options(await styles(page.studio.state.library, page.workspace.key, palette))

    async def _models(self) -> dict[str, dict[str, str]]:
        """Shown names of talkers, faces and palettes, by kind and value."""
        library, styles = self._page.studio.state.library, self._page.studio.styles
        key = self._page.workspace.key
        found = {
            kind: {name: _model_name(name) for name in await models(library, key, kind)}
            for kind in (TALKER, FACE, PALETTE)
        }
        own = styles.store.path(key.name)
        if own.is_file():
            found[PALETTE][str(own)] = "my styles"
        return found

    def set_enabled(self, is_enabled: bool) -> None:
        """Allow or refuse changes."""
        for control in self._controls.values():
            control.set_enabled(is_enabled)
        self._marks.set_enabled(is_enabled)

    def _select(self, part: str, name: str, label: str, options: dict[str, str], *, with_filter: bool = False) -> None:
        value = self._value(name)
        if value not in options:
            options = {**options, value: value}  # a choice that no longer exists stays visible
        control = ui.select(options, label=label, value=value, with_input=with_filter)
        control.props("dense outlined options-dense")
        control.on_value_change(lambda event: self._change(part, name, event.value))
        self._controls[name] = control

    def _slider(self, name: str, label: str, low: float, high: float, step: float) -> None:
        with ui.element("div"):
            shown = ui.label().classes("quiet")
            slider = ui.slider(min=low, max=high, step=step, value=self._value(name)).props(f'aria-label="{label}"')
        shown.bind_text_from(slider, "value", lambda value: f"{label} {value:.2f}")
        slider.on("change", lambda event: self._change("request", name, float(event.args)))
        self._controls[name] = slider

    def _value(self, name: str) -> Any:
        project = self._page.workspace.project
        owner = project.request if hasattr(project.request, name) else project.models
        value = getattr(owner, name)
        if name == "palette" and value is not None and os.sep in value:
            value = os.path.normpath(value)
        return "" if value is None else value

    def _show(self, name: str) -> None:
        control, value = self._controls[name], self._value(name)
        options = getattr(control, "options", None)
        if isinstance(options, dict) and value not in options:
            control.set_options({**options, value: value}, value=value)
        elif control.value != value:
            control.value = value

    async def _change(self, part: str, name: str, value: Any) -> None:
        # a control that is set by the server reports it as a change
        if value is None or value == self._value(name):
            return
        options = {name: None if value == "" and name != "text" else value}
        if name == "face":  # presets and hair belong to a face
            options |= dict.fromkeys(APPEARANCE)
        await self._page.edit({"kind": part, "options": options})


def _model_name(name: str) -> str:
    return "the talker's own face" if name == OWN_FACE else name
