"""What is painted on a timeline, and what cannot be."""

import json
import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from lexicon.errors import DataError, InputError
from tts2face.gestures.elements import (
    GAIN_NAMES,
    ExpressionSpan,
    Gains,
    GazeTarget,
    Gesture,
    ListeningSpan,
    StyleSpan,
)
from tts2face.gestures.movements import head_turn, timed
from tts2face.gestures.timeline import BLEND_S, ONSET_S, Timeline, parse_expressions, parse_gains, parse_style
from tts2face.gestures.timeline_file import parse_timeline, parse_timeline_object, read_timeline, timeline_json
from tts2face.models.palette import EXPRESSIONS, FEATURES, Palette, Style

TIMES = np.linspace(0, 12, 1201)


def palette() -> Palette:
    zeros = np.zeros(3, np.float32)
    return Palette(
        neutral=np.zeros((478, 3), np.float32),
        regions={},
        styles={"neutral": Style(np.array([3], np.int32), zeros, zeros, {})},
        derivations={},
    )


@st.composite
def disjoint(draw: st.DrawFn) -> tuple[StyleSpan, ...]:
    """Spans of brows that do not overlap, in any order."""
    edges = sorted(draw(st.lists(st.floats(0, 10), min_size=2, max_size=10, unique=True)))
    made = [StyleSpan("brows", draw(st.sampled_from("abc")), a, b) for a, b in pairwise(edges)]
    return tuple(draw(st.permutations([span for span in made if draw(st.booleans())])))


@given(disjoint())
def test_styles_share_a_feature_wholly(spans: tuple[StyleSpan, ...]) -> None:
    shares = Timeline(spans=spans).style_shares("brows", TIMES, default="neutral")
    np.testing.assert_allclose(sum(shares.values()), 1.0, atol=1e-9)
    assert all((share >= 0).all() and (share <= 1).all() for share in shares.values())
    assert Timeline(spans=spans).style_shares("head", TIMES, default="neutral").keys() == {"neutral"}


@given(disjoint())
def test_far_from_edges_a_single_style_is_active(spans: tuple[StyleSpan, ...]) -> None:
    timeline = Timeline(spans=spans)
    edges = np.array([edge for span in spans for edge in (span.start, span.end)] or [-9.0])
    at = TIMES[np.abs(TIMES[:, None] - edges).min(axis=1) > BLEND_S / 2]
    shares = timeline.style_shares("brows", at, default="neutral")
    active = timeline.style_at("brows", at, default="neutral")
    np.testing.assert_allclose([shares[name][k] for k, name in enumerate(active)], 1.0, rtol=1e-6)


@given(disjoint(), disjoint())
def test_of_two_timelines_the_second_takes_precedence(
    under: tuple[StyleSpan, ...], over: tuple[StyleSpan, ...]
) -> None:
    both = Timeline(spans=under).merge(Timeline(spans=over))
    first, second, seen = (
        one.style_at("brows", TIMES, default="-") for one in (Timeline(spans=under), Timeline(spans=over), both)
    )
    assert seen == tuple(a if b == "-" else b for a, b in zip(first, second, strict=True))


@given(disjoint(), st.floats(0, 10), st.floats(0.1, 5))
def test_a_part_of_a_timeline_is_the_same_there(spans: tuple[StyleSpan, ...], start: float, length: float) -> None:
    whole = Timeline(spans=spans)
    inside = np.array([second for second in TIMES if start <= second < start + length])
    assert whole.restrict(start, start + length).style_at("brows", inside, default="-") == whole.style_at(
        "brows", inside, default="-"
    )


def test_spans_are_half_open_and_a_default_fills_the_rest() -> None:
    timeline = Timeline({"brows": "calm"}, (StyleSpan("brows", "cross", 1.0, 2.0),))
    assert timeline.style_at("brows", [0.0, 1.0, 1.99, 2.0], default="x") == ("calm", "cross", "cross", "calm")
    assert timeline.style_at("head", [1.5], default="x") == ("x",)
    assert timeline.style_names == ("calm", "cross")


def test_expressions_rise_and_fall_smoothly() -> None:
    weights = Timeline(expressions=(ExpressionSpan("happy", 0.6, 2.0, 4.0),)).expression_weights(TIMES)
    happy = weights[:, EXPRESSIONS.index("happy")]
    assert np.delete(weights, EXPRESSIONS.index("happy"), axis=1).max() == 0
    np.testing.assert_allclose(happy[(TIMES > 2 + ONSET_S / 2) & (TIMES < 4 - ONSET_S / 2)], 0.6)
    assert happy[(TIMES < 2 - ONSET_S / 2) | (TIMES > 4 + ONSET_S / 2)].max() == pytest.approx(0, abs=1e-12)
    np.testing.assert_allclose(happy[[200, 400]], 0.3)  # half at the edges
    assert np.abs(np.diff(happy)).max() < 2 * 0.6 * 0.01 / ONSET_S + 1e-9


def test_spans_at_the_ends_of_a_clip_are_fully_active_there() -> None:
    weights = Timeline(expressions=(ExpressionSpan("sad", 1.0, 0.0, math.inf),)).expression_weights([0.0, 1.0, 1e6])
    np.testing.assert_array_equal(weights[:, EXPRESSIONS.index("sad")], 1.0)


def nod_pitch(nod: Gesture) -> NDArray[np.float64]:
    return np.asarray(np.degrees(head_turn(timed((nod,), TIMES), TIMES)[:, 0]))


def test_a_nod_turns_six_degrees_down_and_slightly_overshoots_rest() -> None:
    pitch = nod_pitch(Gesture(1.0))
    assert pitch.max() == pytest.approx(6.0, abs=0.01)
    assert TIMES[np.argmax(pitch)] == pytest.approx(1.18, abs=0.01)
    assert pitch.min() == pytest.approx(-0.6, abs=0.01)
    np.testing.assert_allclose(pitch[(TIMES <= 1.0) | (TIMES >= 1.56)], 0.0, atol=1e-9)
    assert np.abs(np.diff(pitch, 2)).max() < 0.12  # degrees in (10 ms)^2: no jerk
    double = nod_pitch(Gesture(1.0, size=2.0))
    np.testing.assert_allclose(double, 2 * pitch)


def test_a_timeline_can_be_moved() -> None:
    parsed = Timeline(spans=(StyleSpan("head", "a", 0.0, math.inf),), gestures=(Gesture(0.5),)).shift(2.0)
    assert (parsed.spans[0].start, parsed.spans[0].end, parsed.gestures[0].time) == (2.0, math.inf, 2.5)


@pytest.mark.parametrize(
    ("make", "reason"),
    [
        (lambda: StyleSpan("ears", "a", 0, 1), "no feature 'ears'; choose expression, brows"),
        (lambda: StyleSpan("head", " ", 0, 1), "a style needs a name"),
        (lambda: StyleSpan("head", "a", -1, 1), "head must begin at 0 s or later, not at -1 s"),
        (lambda: StyleSpan("head", "a", math.nan, 1), "start must be a number, not NaN"),
        (lambda: StyleSpan("head", "a", 2, 2), "must end after it begins, not run from 2 to 2 s"),
        (lambda: StyleSpan("head", "a", 2, math.nan), "end must be a number, not NaN"),
        (lambda: ExpressionSpan("neutral", 1, 0, 1), "the expression neutral has no effect"),
        (lambda: ExpressionSpan("bored", 1, 0, 1), "no expression 'bored'; choose sad, happy"),
        (lambda: ExpressionSpan("sad", 1.6, 0, 1), "weight of sad must lie between -0.5 and 1.5, not 1.6"),
        (lambda: ExpressionSpan("sad", 1, 3, 1), "must end after it begins, not run from 3 to 1 s"),
        (lambda: Gesture(-0.1), "a gesture needs a time of 0 s or more, not -0.1"),
        (lambda: Gesture(1, size=5), "size of the gesture nod must lie between 0.1 and 2, not 5"),
        (lambda: Gains({"head": 3.5}), "gain of head must lie between 0 and 3, not 3.5"),
        (lambda: Gains({"ears": 1}), "no feature 'ears'; choose .*jaw, lips"),
        (lambda: Timeline({"jaw": "a"}), "no feature 'jaw'"),
        (
            lambda: Timeline(spans=(StyleSpan("head", "a", 1, 3), StyleSpan("head", "b", 2, 4))),
            "two spans of head overlap: 1-3 s and 2-4 s",
        ),
        (
            lambda: Timeline(expressions=(ExpressionSpan("sad", 1, 0, 3), ExpressionSpan("sad", 1, 2, 4))),
            "two spans of sad overlap",
        ),
        (
            lambda: Timeline({"head": "cross"}).check_styles(palette()),
            "no style 'cross' in the palette; it has neutral",
        ),
        (
            lambda: Timeline(spans=(StyleSpan("head", "neutral", 1, 9.2),)).check_duration(9),
            r"span of head from 1 to 9\.2 s lies beyond the clip, which lasts 9\.00 s",
        ),
        (
            lambda: Timeline(expressions=(ExpressionSpan("sad", 1, 9.0, math.inf),)).check_duration(9),
            "the span of sad from 9 s to the end lies beyond the clip, which lasts 9.00 s; let it begin earlier",
        ),
        (lambda: Timeline(gaze=(GazeTarget(0, 0, 1, 9),)).check_duration(8), "the span of the gaze from 1 to 9 s lies"),
        (
            lambda: Timeline(listens=(ListeningSpan(3, 9),)).check_duration(8),
            "span of listening from 3 to 9 s .*; shorten",
        ),
        (
            lambda: Timeline(listens=(ListeningSpan(3, math.inf), ListeningSpan(5, 9))),
            "two spans of listening overlap: 3 s to the end and 5-9 s; let one",
        ),
        (lambda: Timeline(gestures=(Gesture(9, "wink"),)).check_duration(8), "the wink at 9 s lies beyond"),
        (lambda: Timeline(gestures=(Gesture(9.5),)).check_duration(9), r"the nod at 9\.5 s lies beyond"),
    ],
)
def test_what_cannot_be_painted_is_refused(make, reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        make()


def test_spans_to_the_end_fit_every_clip() -> None:
    Timeline({"head": "neutral"}, (StyleSpan("head", "neutral", 1, 2.04),), gestures=(Gesture(1.9),)).check_duration(
        2.0
    )
    Timeline(spans=(StyleSpan("head", "neutral", 1, math.inf),)).check_duration(2.0)


@pytest.mark.parametrize(
    ("written", "meant"),
    [
        ("delighted", dict.fromkeys(FEATURES, "delighted")),
        ("brows=annoyed, head=delighted", {"brows": "annoyed", "head": "delighted"}),
        ("calm,head=cross", {**dict.fromkeys(FEATURES, "calm"), "head": "cross"}),
        ("head=cross,all=calm", {**dict.fromkeys(FEATURES, "calm"), "head": "cross"}),
    ],
)
def test_styles_as_people_write_them(written: str, meant: dict) -> None:
    assert parse_style(written) == meant


@given(st.dictionaries(st.sampled_from(GAIN_NAMES), st.integers(0, 30).map(lambda n: n / 10), min_size=1))
def test_written_gains_are_read_back(factors: dict) -> None:
    assert parse_gains(",".join(f"{name}={factor:g}" for name, factor in factors.items())).factors == factors


def test_gains_apply_to_every_feature() -> None:
    gains = parse_gains("all=0.5,head=2")
    assert [gains.of(name) for name in ("brows", "head", "jaw")] == [0.5, 2.0, 1.0]


def test_expressions_as_people_write_them() -> None:
    assert parse_expressions("happy=0.6@1.2-3.4,sad=-0.3, angry=1@2,afraid=1@2-") == (
        ExpressionSpan("happy", 0.6, 1.2, 3.4),
        ExpressionSpan("sad", -0.3, 0.0, math.inf),
        ExpressionSpan("angry", 1.0, 2.0, math.inf),
        ExpressionSpan("afraid", 1.0, 2.0, math.inf),
    )


@pytest.mark.parametrize(
    ("read", "written", "reason"),
    [
        (parse_style, "", "cannot read '' in ''; a style is a name"),
        (parse_style, "head=", "cannot read 'head='"),
        (parse_style, "=calm", "cannot read '=calm'"),
        (parse_style, "head=a=b", "cannot read 'head=a=b'"),
        (parse_style, "head=a,,brows=b", "cannot read ''"),
        (parse_style, "head=a,head=b", "for head twice"),
        (parse_style, "calm,cross", "for all twice"),
        (parse_style, "ears=calm", "no feature 'ears'"),
        (parse_gains, "head", "cannot read 'head' in 'head'; gains are written"),
        (parse_gains, "head=big", "'big' is not a number; gains are written"),
        (parse_gains, "head=nan", "'nan' is not a finite number"),
        (parse_gains, "head=4", "gain of head must lie between 0 and 3, not 4"),
        (parse_gains, "jaw=1,jaw=2", "for jaw twice"),
        (parse_gains, "ears=1", "no feature 'ears'"),
        (parse_expressions, "happy", "cannot read 'happy'"),
        (parse_expressions, "happy=much", "'much' is not a number"),
        (parse_expressions, "happy=1@x-2", "'x' is not a number"),
        (parse_expressions, "happy=1@3-2", "must end after it begins"),
        (parse_expressions, "happy=2", "must lie between -0.5 and 1.5, not 2"),
        (parse_expressions, "happy=1@", "'' is not a number"),
    ],
)
def test_what_is_written_wrongly_is_refused(read, written: str, reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        read(written)


def test_a_file_holds_a_timeline(tmp_path: Path) -> None:
    parsed = {
        "style": {"all": "calm", "head": "cross"},
        "spans": [
            {"feature": "brows", "style": "annoyed", "start": 1.0, "end": 2.5},
            {"feature": "all", "style": "delighted", "start": 3},
        ],
        "expressions": [{"expression": "happy", "weight": 0.6, "start": 1.2, "end": 3.4}],
        "nods": [{"time": 0.7}, {"time": 0.2, "size": 0.5}],
        "gestures": [{"time": 0.4, "name": "look_at", "left_deg": 10, "seconds": 2}],
        "brow_raises": [{"time": 0.5}],
        "gains": {"head": 1.5, "jaw": 1},
    }
    path = tmp_path / "a.json"
    path.write_text(json.dumps(parsed), encoding="utf-8-sig")
    timeline = read_timeline(path)
    assert timeline.style == {**dict.fromkeys(FEATURES, "calm"), "head": "cross"}
    assert timeline.spans[0] == StyleSpan("brows", "annoyed", 1.0, 2.5)
    assert {span.feature for span in timeline.spans[1:]} == set(FEATURES)
    assert timeline.expressions == (ExpressionSpan("happy", 0.6, 1.2, 3.4),)
    look = Gesture(0.4, "look_at", seconds=2.0, left_deg=10.0)
    assert timeline.gestures == (Gesture(0.2, size=0.5), look, Gesture(0.5, "brows_up"), Gesture(0.7))
    assert parse_timeline_object(timeline_json(timeline)).gestures == timeline.gestures
    assert timeline.gains.factors == {"head": 1.5, "jaw": 1.0}
    assert parse_timeline("{}").style_names == ()
    assert parse_timeline('{"style": "calm"}').style == dict.fromkeys(FEATURES, "calm")


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ("{", r"a\.json, line 1: not JSON"),
        ("[]", r"a\.json: give an object in curly brackets, not \[\]"),
        ("[" * 100_000, r"a\.json is nested too deep"),
        ('{"colour": 1}', r"a\.json: there is no 'colour' here; choose style, spans"),
        ('{"style": 1}', r"a\.json, style: give a name, or a style for each feature, not 1"),
        ('{"style": {"ears": "a"}}', r"a\.json, style: there is no feature 'ears'"),
        ('{"style": {"head": 1}}', r"a\.json, style: head must be a text in quotes, not 1"),
        ('{"spans": {}}', r"a\.json, spans: give a list in square brackets, not \{\}"),
        ('{"spans": [1]}', r"a\.json, spans\[0\]: give an object in curly brackets, not 1"),
        ('{"spans": [{"style": "a", "start": 1}]}', r"spans\[0\]: feature is missing"),
        ('{"spans": [{"feature": "head", "style": "a", "start": "1"}]}', r'start must be a number, not "1"'),
        ('{"spans": [{"feature": "head", "style": "a", "start": true}]}', r"start must be a number, not true"),
        ('{"spans": [{"feature": "head", "style": "a", "start": 1, "end": null}]}', r"end must be a number, not null"),
        ('{"spans": [{"feature": "head", "style": "a", "start": 1, "stop": 2}]}', r"spans\[0\]: there is no 'stop'"),
        ('{"spans": [{"feature": "head", "style": "a", "start": 3, "end": 2}]}', r"spans\[0\]: .* not run from 3 to 2"),
        ('{"spans": [{"feature": "head", "style": "a", "start": 1e999}]}', r"a\.json: the number 1e999 is too large"),
        (
            '{"spans": [{"feature": "head", "style": "a", "start": 1}, {"feature": "all", "style": "a", "start": 2}]}',
            r"a\.json: two spans of head overlap: 1 s to the end and 2 s to the end",
        ),
        ('{"expressions": [{"expression": "sad", "weight": 9}]}', r"expressions\[0\]: the weight of sad must lie"),
        ('{"nods": [{"time": 1}, {"time": -1}]}', r"nods\[1\]: a gesture needs a time of 0 s or more, not -1"),
        ('{"gains": {"head": 9}}', r"a\.json, gains: the gain of head must lie between 0 and 3, not 9"),
        ('{"gains": {"head": 1, "head": 2}}', r"a\.json: the name 'head' occurs twice"),
        ('{"gains": {"head": ' + "1" * 5000 + "}}", r"a\.json: a number of 5000 characters is too long"),
        ('{"gains": {"head": NaN}}', r"a\.json: NaN is not a JSON number"),
        (b"\xff\xff", r"a\.json is not UTF-8 text \(byte 0\)"),
        (b" " * 10_000_001, r"a\.json contains more than 10 MB"),
    ],
)
def test_files_that_are_wrong_are_refused(content: str | bytes, reason: str, tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(DataError, match=reason):
        read_timeline(path)


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot read the timeline"):
        read_timeline(tmp_path / "none.json")
