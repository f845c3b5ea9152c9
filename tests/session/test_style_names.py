"""Styles that a project names: found, renamed and removed everywhere."""

from tts2face.gestures.elements import StyleSpan
from tts2face.gestures.timeline import Timeline
from tts2face.request import Request
from tts2face.session.project import Project, drop_style, rename_style, used_styles

SPANS = (StyleSpan("head", "mine", 0.0, 1.0), StyleSpan("brows", "delighted", 0.0, 1.0))
PROJECT = Project(request=Request(text="Hello.", style="neutral,head=mine"), timeline=Timeline(spans=SPANS))


def test_styles_are_found():
    assert used_styles(PROJECT) == {"mine", "delighted", "neutral"}
    assert used_styles(Project()) == frozenset()


def test_a_new_name_reaches_timeline_and_request():
    renamed = rename_style(PROJECT, "mine", "my calm one")
    assert used_styles(renamed) == {"my calm one", "delighted", "neutral"}
    assert [span.style for span in renamed.timeline.spans] == ["my calm one", "delighted"]
    assert rename_style(renamed, "my calm one", "mine").timeline == PROJECT.timeline


def test_a_removed_style_leaves_the_rest():
    less = drop_style(PROJECT, "mine")
    assert used_styles(less) == {"delighted", "neutral"}
    assert less.timeline.spans == SPANS[1:]
    assert drop_style(Project(request=Request(text="Hello.", style="mine")), "mine").request.style is None
