"""Timeline of the gestures of a request."""

from pathlib import Path

import pytest

from lexicon.errors import DataError, InputError
from tts2face.gestures.elements import ExpressionSpan, Gesture
from tts2face.models.palette import FEATURES
from tts2face.request import Request
from tts2face.session.request_timeline import build_request_timeline

PLAN = """{"style": {"all": "calm", "head": "cross"}, "nods": [{"time": 1}], "gains": {"head": 2, "jaw": 0.5},
"expressions": [{"expression": "happy", "weight": 1, "start": 0, "end": 9}]}"""


def test_flags_win_over_the_file(tmp_path: Path) -> None:
    (tmp_path / "plan.json").write_text(PLAN)
    timeline = build_request_timeline(
        Request(
            text="Hi.",
            timeline=tmp_path / "plan.json",
            style="head=delighted",
            gain="head=1.5",
            expression="happy=0.5@2-3",
        )
    )
    assert timeline.style == {**dict.fromkeys(FEATURES, "calm"), "head": "delighted"}
    assert timeline.gains.factors == {"head": 1.5, "jaw": 0.5}
    assert timeline.gestures == (Gesture(1.0),)
    assert timeline.expressions == (
        ExpressionSpan("happy", 1.0, 0.0, 2.0),
        ExpressionSpan("happy", 0.5, 2.0, 3.0),
        ExpressionSpan("happy", 1.0, 3.0, 9.0),
    )


def test_a_request_without_gestures_has_an_empty_timeline() -> None:
    timeline = build_request_timeline(Request(text="Hi."))
    assert (timeline.style, timeline.spans, timeline.expressions, timeline.gestures) == ({}, (), (), ())


@pytest.mark.parametrize(
    ("options", "kind", "reason"),
    [
        ({"style": "ears=a"}, InputError, "no feature 'ears'"),
        ({"gain": "head=9"}, InputError, "must lie between 0 and 3, not 9"),
        ({"expression": "glad=1"}, InputError, "no expression 'glad'"),
        ({"timeline": Path("none.json")}, InputError, "cannot read the timeline none.json"),
        ({"timeline": Path(__file__)}, DataError, "line 1: not JSON"),
    ],
)
def test_what_cannot_be_read_is_refused(options: dict, kind: type, reason: str) -> None:
    with pytest.raises(kind, match=reason):
        build_request_timeline(Request(text="Hi.", **options))
