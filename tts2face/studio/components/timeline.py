"""The timeline of a page: sound, words, phones and lanes of gestures, on which styles are painted."""

from collections.abc import Mapping, Sequence
from typing import Any

from nicegui.element import Element

from tts2face.studio.components.stage import COMPONENTS, MODULES


class Timeline(Element, component="timeline.js", esm={MODULES: str(COMPONENTS)}):
    """Timeline of a project; emits ``edit`` with an edit of `tts2face.studio.editing`.

    Parameters
    ----------
    timeline
        JSON of the project's timeline.
    styles
        Styles with their colours: ``name``, ``color``.
    lanes
        State of the lanes: ``muted`` and ``solo``, lists of features.
    """

    def __init__(
        self, timeline: Mapping[str, Any], styles: Sequence[Mapping[str, str]], lanes: Mapping[str, Any]
    ) -> None:
        super().__init__()
        self._props.update(timeline=timeline, styles=styles, lanes=lanes, brush={"tool": "select", "style": ""})

    def set_timeline(self, timeline: Mapping[str, Any], lanes: Mapping[str, Any]) -> None:
        """Show another state of the project."""
        self._props.update(timeline=timeline, lanes=lanes)
        self.update()

    def set_styles(self, styles: Sequence[Mapping[str, str]]) -> None:
        """Offer other styles."""
        self._props["styles"] = styles
        self.update()

    def set_brush(self, tool: str, style: str) -> None:
        """Choose a tool (brush, eraser, select) and its style."""
        self._props["brush"] = {"tool": tool, "style": style}
        self.update()
