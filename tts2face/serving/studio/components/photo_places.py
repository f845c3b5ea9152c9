"""Lips, lids, teeth and pivot over a picture of a person, which are dragged where they belong."""

import base64
from collections.abc import Callable, Mapping
from typing import Any

from nicegui import events
from nicegui.element import Element

from tts2face.serving.studio.components.stage import COMPONENTS, MODULES


class PhotoPlacesElement(Element, component="photo_places.js", esm={MODULES: str(COMPONENTS)}):
    """Handles over a picture.

    Parameters
    ----------
    on_change
        Gets the fit (docs/photo.md) whenever a person has changed it.
    """

    def __init__(self, on_change: Callable[[Mapping[str, Any]], None]) -> None:
        super().__init__()
        self._props.update(picture="", size=[1, 1], fit={})
        self.on("change", lambda event: self._changed(event, on_change))

    def show(self, jpeg: bytes, size: tuple[int, int], fit: Mapping[str, Any]) -> None:
        """Show a picture, a JPEG, whose places are pixels of a picture of `size` (width, height)."""
        address = f"data:image/jpeg;base64,{base64.b64encode(jpeg).decode()}"
        self._props.update(picture=address, size=list(size), fit=dict(fit))
        self.update()

    def hide(self) -> None:
        """Show no picture."""
        self._props["picture"] = ""
        self.update()

    @staticmethod
    def _changed(event: events.GenericEventArguments, on_change: Callable[[Mapping[str, Any]], None]) -> None:
        on_change(event.args)
