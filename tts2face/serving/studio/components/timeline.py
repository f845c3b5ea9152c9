"""The timeline of a page: sound, words, phones, painted styles, key points and curves over time."""

from collections.abc import Mapping, Sequence
from typing import Any

from nicegui.element import Element
from nicegui.events import GenericEventArguments, Handler

from tts2face.models.palette import EXPRESSIONS, FEATURES
from tts2face.serving.studio.components.stage import COMPONENTS, MODULES


class TimelineElement(Element, component="timeline.js", esm={MODULES: str(COMPONENTS)}):
    """Timeline of a project.

    Parameters
    ----------
    timeline
        The project's timeline as `tts2face.gestures.timeline_file.timeline_json` gives it.
    styles
        Styles of the palette: objects with ``name`` and ``color`` (#rrggbb).
    brush
        ``tool`` (brush, eraser or select) and ``style``, the name of the style that the brush paints.
    lanes
        Features from top to bottom: names, or objects with ``feature``, ``muted``, ``solo`` and ``seed``.
    on_edit
        Called with one edit (docs/decisions): its ``args`` is the JSON object.
    preview, compare
        Addresses of the preview bundle that is loaded first, and of one whose curves are drawn beside it.

    Notes
    -----
    Also emits ``pick`` with a clicked word or phone (``kind``, ``name``, ``begin``, ``end``, ``index`` in the sentence,
    ``text`` and ``occurrence`` of the sentence), and ``range`` with the selection as [start, end] in seconds, or null.
    """

    def __init__(  # noqa: PLR0913 - one parameter a prop
        self,
        timeline: Mapping[str, Any] | None = None,
        *,
        styles: Sequence[Mapping[str, str]] = (),
        brush: Mapping[str, str] | None = None,
        lanes: Sequence[str | Mapping[str, Any]] = FEATURES,
        on_edit: Handler[GenericEventArguments] | None = None,
        preview: str | None = None,
        compare: str | None = None,
    ) -> None:
        super().__init__()
        self._props.update(
            timeline=dict(timeline or {}), styles=list(styles), brush=dict(brush or {"tool": "select", "style": ""}),
            lanes=list(lanes), expressions=list(EXPRESSIONS), preview=preview, compare=compare,
        )  # fmt: skip
        if on_edit is not None:
            self.on("edit", on_edit)

    def set_timeline(self, timeline: Mapping[str, Any]) -> None:
        """Show what the server made of the edits; it replaces what the page assumed."""
        self._set(timeline=dict(timeline))

    def set_styles(self, styles: Sequence[Mapping[str, str]]) -> None:
        """Show the styles of another palette."""
        self._set(styles=list(styles))

    def set_brush(self, tool: str, style: str) -> None:
        """Choose what a press on a lane does."""
        self._set(brush={"tool": tool, "style": style})

    def set_lanes(self, lanes: Sequence[str | Mapping[str, Any]]) -> None:
        """Show which lanes are muted or solo, and their seeds."""
        self._set(lanes=list(lanes))

    def set_compare(self, url: str | None) -> None:
        """Draw the curves of a second preview; None removes them."""
        self._set(compare=url)

    def set_preview(self, url: str) -> None:
        """Fetch what has changed of a preview; the stage of the page shows it, too."""
        self.run_method("setPreview", url)

    def play(self, start: float | None = None) -> None:
        """Play from a time in seconds, from the playhead without one."""
        self.run_method("play", start)

    def pause(self) -> None:
        """Stop playing."""
        self.run_method("pause")

    def seek(self, time: float) -> None:
        """Move the playhead."""
        self.run_method("seek", time)

    def _set(self, **props: Any) -> None:
        self._props.update(props)
        self.update()
