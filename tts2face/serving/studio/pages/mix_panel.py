"""Sliders from which a derived style is mixed, with a moving picture of what they make."""

import json
from dataclasses import asdict
from typing import Any
from urllib.parse import quote

from nicegui import ui

from tts2face.models.palette import EXPRESSIONS
from tts2face.models.palette_editing import StyleMix
from tts2face.serving.service.keys import ApiKey
from tts2face.serving.service.page_addresses import STYLES
from tts2face.serving.studio.pages.frame import heading, shown_errors
from tts2face.serving.studio.styles import Styles

SIZES = {"head": "head", "brows": "brows", "blink": "lids", "cheeks": "cheeks", "gaze": "gaze"}
FREE = "expressions", "sizes"
STEP = 0.05


class MixPanel:
    """Sliders of a new derived style."""

    def __init__(self, styles: Styles, key: ApiKey) -> None:
        self._styles, self._key = styles, key
        self._shares: dict[str, Any] = {}  # sliders by name
        self._others: dict[str, dict[str, Any]] = {part: {} for part in FREE}
        self._is_drawing = self._is_stale = False

    def build(self) -> None:
        """Build the panel."""
        with ui.element("div").classes("mix"):
            self._picture = ui.element("span").classes("swatch")
            self._picture.props('role=img aria-label="Moving picture of the mixed style"')
            with ui.element("div").style("display: flex; flex-direction: column; gap: .5rem"):
                self._source = ui.select([], label="Motion of", on_change=self._draw)
                self._source.props("dense outlined options-dense").style("width: 100%")
                self._name = ui.input("Name of the style").props("dense outlined maxlength=40")
                with ui.element("div").classes("line"):
                    ui.button("Keep the style", on_click=self._keep)
                    ui.button("Reset", on_click=self._reset).props("flat")
        heading(3, "Styles")
        self._share_place = ui.element("div").classes("sliders")
        heading(3, "Size of the motion")
        with ui.element("div").classes("sliders"):
            for feature, shown in SIZES.items():
                self._others["sizes"][feature] = self._slider(shown, "Size of the motion: ", 0.0, 3.0, 1.0)
            self._tempo = self._slider("tempo", "", 0.5, 2.0, 1.0)
        heading(3, "Added expressions")
        with ui.element("div").classes("sliders"):
            for expression in EXPRESSIONS:
                self._others["expressions"][expression] = self._slider(expression, "Added expression: ", -1.0, 1.5, 0.0)

    def set_styles(self) -> None:
        """Offer the styles of the palette as it is now."""
        palette = self._styles.store.read(self._key.name)
        chosen = self._source.value if self._source.value in palette.styles else next(iter(palette.styles))
        values = {name: slider.value for name, slider in self._shares.items()}
        self._share_place.clear()
        with self._share_place:
            self._shares = {
                name: self._slider(name, "Share of ", 0.0, 1.0, 0.0, values.get(name)) for name in palette.derivations
            }
        if not values and "neutral" in self._shares:
            self._shares["neutral"].value = 1.0
        self._source.set_options(list(palette.styles), value=chosen)

    def mix(self) -> StyleMix:
        """The values of the sliders."""
        return StyleMix(
            str(self._source.value),
            {name: float(slider.value) for name, slider in self._shares.items() if slider.value},
            {name: float(slider.value) for name, slider in self._others["expressions"].items() if slider.value},
            {name: float(slider.value) for name, slider in self._others["sizes"].items() if slider.value != 1.0},
            float(self._tempo.value),
        )

    def _slider(self, shown: str, prefix: str, low: float, high: float, rest: float, value: float | None = None) -> Any:
        ui.label(shown)
        slider = ui.slider(min=low, max=high, step=STEP, value=rest if value is None else value)
        slider.props(f'dense aria-label="{prefix}{shown}"').on("change", self._draw)
        slider.rest = rest  # type: ignore[attr-defined]
        ui.label().classes("value").bind_text_from(slider, "value", lambda now: f"{now:.2f}")
        return slider

    async def _keep(self) -> None:
        with shown_errors():
            name = await self._styles.derive(self._key, self._name.value or "", self.mix())
            self._name.value = ""
            ui.notify(f"The style {name} is in your palette.", type="positive")

    async def _reset(self) -> None:
        others = [slider for part in self._others.values() for slider in part.values()]
        for slider in (*self._shares.values(), self._tempo, *others):
            slider.value = slider.rest
        await self._draw()

    async def _draw(self) -> None:
        """Show what the sliders say; while one picture is made, only the last of further changes counts."""
        self._is_stale = True
        if self._is_drawing or not self._source.value:
            return
        self._is_drawing = True
        try:
            while self._is_stale:
                self._is_stale = False
                with shown_errors():
                    mix = self.mix()
                    await self._styles.draw_mix(self._key, mix)  # the page gets it at once, without a gap
                    address = f"{STYLES}/mix.webp?mix={quote(json.dumps(asdict(mix)))}"
                    self._picture.style(f"background-image: url({address})")
        finally:
            self._is_drawing = False
