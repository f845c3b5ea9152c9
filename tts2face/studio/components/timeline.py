"""The timeline of a page: sound, words, phones and lanes of gestures, on which styles are painted."""

from collections.abc import Mapping, Sequence
from typing import Any

from nicegui.element import Element
from nicegui.events import GenericEventArguments, Handler

from tts2face.studio.components.stage import COMPONENTS, MODULES


class Timeline(Element, component="timeline.js", esm={MODULES: str(COMPONENTS)}):
    """Timeline of a project.

    Parameters
    ----------
    timeline
        JSON of the project's timeline.
    styles
        Styles with their colours: ``name``, ``color``.
    lanes
        Features with ``feature``, ``muted``, ``solo`` and ``seed``.
    on_edit
        Called with an edit of `tts2face.studio.editing` as ``args``.
    """

    def __init__(
        self,
        timeline: Mapping[str, Any],
        *,
        styles: Sequence[Mapping[str, str]],
        lanes: Sequence[Mapping[str, Any]],
        on_edit: Handler[GenericEventArguments],
    ) -> None:
        super().__init__()
        self._props.update(timeline=timeline, styles=styles, lanes=lanes, brush={"tool": "select", "style": ""})
        self.on("edit", on_edit)

    def set_timeline(self, timeline: Mapping[str, Any]) -> None:
        """Show another state of the project."""
        self._set(timeline=timeline)

    def set_styles(self, styles: Sequence[Mapping[str, str]]) -> None:
        """Offer other styles."""
        self._set(styles=styles)

    def set_brush(self, tool: str, style: str) -> None:
        """Choose a tool (brush, eraser, select) and its style."""
        self._set(brush={"tool": tool, "style": style})

    def set_lanes(self, lanes: Sequence[Mapping[str, Any]]) -> None:
        """Show which lanes are muted or solo, and their seeds."""
        self._set(lanes=lanes)

    def set_compare(self, url: str | None) -> None:
        """Draw the curves of a second preview; None removes them."""
        self._set(compare=url)

    def _set(self, **props: Any) -> None:
        self._props.update(props)
        self.update()
