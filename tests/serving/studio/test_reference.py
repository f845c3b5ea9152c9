"""What a project is compared with."""

from pathlib import Path

import pytest

from lexicon.errors import DataError, InputError
from tts2face.gestures.elements import StyleSpan
from tts2face.gestures.timeline import Timeline
from tts2face.request import Request
from tts2face.serving.studio.reference import Reference, parse_reference, reference_json, reference_project
from tts2face.session.project import Project

PROJECT = Project("One", Request(text="Hello.", style="delighted", pitch=True), timeline=Timeline(
    spans=(StyleSpan("head", "delighted", 0.0, 0.5),)))  # fmt: skip


def test_settings_change_only_what_they_name() -> None:
    other = reference_project(Reference("settings", request={"seed": 4}, models={"talker": "mine"}), PROJECT)
    assert (other.request.seed, other.models.talker) == (4, "mine")
    assert (other.request.text, other.timeline, other.models.face) == ("Hello.", PROJECT.timeline, PROJECT.models.face)


@pytest.mark.parametrize(("gestures", "style"), [("none", None), ("noise", "delighted"), ("ju2008", "delighted")])
def test_options_that_other_gestures_exclude_are_removed(gestures: str, style: str | None) -> None:
    other = reference_project(Reference("settings", request={"gestures": gestures}), PROJECT)
    assert other.request.style == style
    assert other.request.pitch == (gestures == "ju2008")
    other.prepare()


def test_a_recorded_reference_depends_on_clock_and_models_only(tmp_path: Path) -> None:
    recording = tmp_path / "a.wav"
    one = Project(request=Request(audio=recording, text="Hello.", fps=25.0))
    two = Project(request=Request(audio=recording, text="Other words.", fps=25.0, seed=9))
    reference = Reference("recording", recording="bbaf2n")
    assert reference_project(reference, one) == reference_project(reference, two)


def test_a_reference_is_read_as_it_was_written(tmp_path: Path) -> None:
    for one in (
        Reference("kept", "then", project=PROJECT),
        Reference("settings", "noise", request={"gestures": "noise"}),
        Reference("recording", "", recording="bbaf2n", offset=0.25),
    ):
        read = parse_reference(reference_json(one, tmp_path), tmp_path)
        assert reference_json(read, tmp_path) == reference_json(one, tmp_path)
        assert (read.project is None) == (one.project is None)


@pytest.mark.parametrize(("content", "reason"), [
    ({"kind": "settings", "request": {"audio": "/etc/passwd"}}, "cannot change 'audio'"),
    ({"kind": "settings", "models": {"voice": "x"}}, "no model 'voice'"),
    ({"kind": "kept"}, "keep it again"),
    ({"kind": "recording"}, "choose one from the list"),
    ({"kind": "recording", "recording": "a", "offset": 1e9}, "an offset 3600"),
    ({"kind": "settings", "request": "x"}, "an object in curly brackets"),
    ({"kind": "take", "offset": "soon"}, "offset must be a number"),
    ({"kind": "take", "offset": float("nan")}, "offset must be a number, not NaN"),
    ({"kind": "take", "path": "x"}, "there is no 'path' here"),
])  # fmt: skip
def test_what_is_no_reference_is_refused(content: dict[str, object], reason: str, tmp_path: Path) -> None:
    with pytest.raises((InputError, DataError), match=reason):
        parse_reference(content, tmp_path)
