"""The styles that a project names, and their change when a palette changes."""

from collections.abc import Callable
from dataclasses import replace

from tts2face.gesture.elements import StyleSpan
from tts2face.gesture.notation import parse_style
from tts2face.project.project import Project


def used_styles(project: Project) -> frozenset[str]:
    """Names of the styles that a project's timeline and request name."""
    asked = parse_style(project.request.style).values() if project.request.style else ()
    return frozenset([*(span.style for span in project.timeline.spans), *asked])


def rename_style(project: Project, name: str, new: str) -> Project:
    """The project with another name for a style."""
    spans = tuple(replace(span, style=new) if span.style == name else span for span in project.timeline.spans)
    return _changed(project, spans, lambda style: new if style == name else style)


def drop_style(project: Project, name: str) -> Project:
    """The project without what is painted in a style: there it has its default style."""
    spans = tuple(span for span in project.timeline.spans if span.style != name)
    return _changed(project, spans, lambda style: None if style == name else style)


def _changed(project: Project, spans: tuple[StyleSpan, ...], change: Callable[[str], str | None]) -> Project:
    timeline = replace(project.timeline, spans=spans)
    if not project.request.style:
        return replace(project, timeline=timeline)
    named = {feature: change(style) for feature, style in parse_style(project.request.style).items()}
    written = ",".join(f"{feature}={style}" for feature, style in named.items() if style is not None)
    return replace(project, timeline=timeline, request=replace(project.request, style=written or None))
