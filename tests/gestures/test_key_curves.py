"""Curves through key points, gaze targets and seeds of a timeline."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lexicon.errors import DataError, InputError
from tts2face.gestures.elements import (
    ChannelEdit,
    ExpressionCurve,
    ExpressionSpan,
    GazeTarget,
    Gesture,
    ListeningSpan,
    StrengthCurve,
    StyleSpan,
    interpolate_keys,
)
from tts2face.gestures.kinds import KINDS
from tts2face.gestures.stream import GestureFields, GestureStream
from tts2face.gestures.timeline import Timeline
from tts2face.gestures.timeline_file import parse_timeline, timeline_json
from tts2face.models.palette import FEATURES, Palette
from tts2face.types import Waveform

FPS = 30.0
KEYS = st.lists(
    st.tuples(st.integers(0, 1000).map(lambda n: n / 100), st.integers(0, 300).map(lambda n: n / 100)),
    min_size=1,
    max_size=6,
    unique_by=lambda key: key[0],
).map(lambda keys: tuple(sorted(keys)))
WHOLE = Timeline(
    style={"head": "wild"},
    spans=(StyleSpan("brows", "wild", 1.0, 2.0),),
    expressions=(ExpressionSpan("happy", 0.5, 1.0, 2.0),),
    gestures=(Gesture(0.5, size=1.5),),
    listens=(ListeningSpan(0.5, 1.0, reacts=False), ListeningSpan(2.0)),
    gaze=(GazeTarget(-5.0, 20.0, 1.0, 2.0), GazeTarget(0.0, 0.0, 2.0, np.inf)),
    strengths=(StrengthCurve("head", ((0.0, 0.0), (2.0, 1.5))),),
    curves=(ExpressionCurve("sad", ((0.0, 0.2),)),),
    edits=(ChannelEdit("jawOpen", ((0.5, 0.0), (1.0, 0.25), (1.5, 0.0))),),
    seeds={"blink": 7},
)


def gestures(palette: Palette, timeline: Timeline, seed: int = 0) -> dict[str, np.ndarray]:
    sound = Waveform(0.3 * np.sin(np.linspace(0, 900, 24_000 * 3)), 24_000)
    stream = GestureStream(GestureFields(palette), style="calm", seed=seed, fps=FPS, seeds=timeline.seeds)
    return dict(stream.next(sound, 90, timeline))


@given(KEYS)
def test_a_curve_passes_its_keys_and_stays_between_neighbours(keys: tuple) -> None:
    times = np.array([time for time, _ in keys])
    values = np.array([value for _, value in keys])
    np.testing.assert_allclose(interpolate_keys(times, keys), values, atol=1e-12)
    dense = interpolate_keys(np.linspace(-1.0, 12.0, 400), keys)
    assert values.min() - 1e-12 <= dense.min() <= dense.max() <= values.max() + 1e-12
    assert dense[0] == pytest.approx(values[0], abs=1e-12)
    assert dense[-1] == pytest.approx(values[-1], abs=1e-12)


def test_a_curve_is_flat_at_its_keys() -> None:
    low, high = interpolate_keys([0.999, 1.001], ((0.0, 0.0), (1.0, 1.0), (2.0, 0.0)))
    assert 1.0 - low < 1e-5
    assert 1.0 - high < 1e-5


def test_strength_scales_one_feature_over_time(palette: Palette) -> None:
    plain = gestures(palette, Timeline())
    scaled = gestures(palette, Timeline(strengths=(StrengthCurve("head", ((1.0, 0.0), (2.0, 2.0))),)))
    np.testing.assert_array_equal(scaled["head"][:30], 0.0)
    np.testing.assert_allclose(scaled["head"][60:], 2.0 * plain["head"][60:], rtol=1e-6)
    for feature in set(plain) - {"head"}:
        np.testing.assert_array_equal(scaled[feature], plain[feature])


def test_brows_rise_by_their_size_and_return(palette: Palette) -> None:
    plain = gestures(palette, Timeline())
    raised = gestures(palette, Timeline(gestures=(Gesture(1.0, "brows_up", 0.5),)))
    height = (raised["brows"] - plain["brows"]) @ palette.brow_lift
    np.testing.assert_allclose(height[35:42], 2.0, atol=1e-4)
    np.testing.assert_allclose(height[[0, 30, 54, 89]], 0.0, atol=1e-4)


def test_the_gaze_reaches_its_target_and_returns(palette: Palette) -> None:
    plain = gestures(palette, Timeline())
    aimed = gestures(palette, Timeline(gaze=(GazeTarget(-5.0, 20.0, 1.0, 2.0),)))
    np.testing.assert_allclose(aimed["gaze"][32:58], np.tile(np.radians([-5.0, 20.0]), (26, 1)), atol=1e-6)
    np.testing.assert_array_equal(aimed["gaze"][:28], plain["gaze"][:28])
    np.testing.assert_array_equal(aimed["gaze"][62:], plain["gaze"][62:])


def test_a_seed_of_a_feature_changes_that_feature_only(palette: Palette) -> None:
    plain, other = gestures(palette, Timeline()), gestures(palette, Timeline(seeds={"blink": 7}))
    assert not np.array_equal(plain["blink"], other["blink"])
    for feature in set(plain) - {"blink"}:
        np.testing.assert_array_equal(other[feature], plain[feature])
    np.testing.assert_array_equal(other["blink"], gestures(palette, Timeline(), seed=7)["blink"])


def test_every_element_is_written_and_read_back() -> None:
    written = json.dumps(timeline_json(WHOLE))
    back = parse_timeline(written)
    assert json.dumps(timeline_json(back)) == written
    assert back == WHOLE
    assert set(json.loads(written)) == {"style", *KINDS, "seeds"}
    assert timeline_json(Timeline()) == {}


def test_the_later_timeline_takes_precedence() -> None:
    later = Timeline(
        gaze=(GazeTarget(1.0, 1.0, 1.5, 2.5),),
        strengths=(StrengthCurve("head", ((0.0, 3.0),)), StrengthCurve("brows", ((0.0, 1.0),))),
        seeds={"blink": 8, "head": 1},
    )
    both = WHOLE.merge(later)
    assert [(target.left_deg, target.start, target.end) for target in both.gaze] == [
        (20.0, 1.0, 1.5),
        (1.0, 1.5, 2.5),
        (0.0, 2.5, np.inf),
    ]
    assert {curve.feature: curve.keys for curve in both.strengths} == {"head": ((0.0, 3.0),), "brows": ((0.0, 1.0),)}
    assert (both.curves, both.edits) == (WHOLE.curves, WHOLE.edits)
    assert both.seeds == {"blink": 8, "head": 1}
    moved = WHOLE.shift(1.0)
    assert all(getattr(moved, name) != getattr(WHOLE, name) for name in KINDS)
    assert moved.edits[0].keys[0] == (1.5, 0.0)
    assert moved.gaze[0].start == 2.0


@pytest.mark.parametrize(
    ("make", "reason"),
    [
        (lambda: StrengthCurve("ears", ((0.0, 1.0),)), "no feature 'ears'"),
        (lambda: StrengthCurve("head", ()), "the strength of head has 0 keys"),
        (lambda: StrengthCurve("head", ((0.0, 9.0),)), "the strength of head must lie between 0 and 3, not 9"),
        (lambda: StrengthCurve("head", ((-1.0, 1.0),)), "has a key at -1 s"),
        (lambda: StrengthCurve("head", ((1.0, 1.0), (1.0, 2.0))), "keys at 1 s and then 1 s"),
        (lambda: ExpressionCurve("glad", ((0.0, 1.0),)), "no expression 'glad'"),
        (lambda: ExpressionCurve("neutral", ((0.0, 1.0),)), "neutral has no effect"),
        (lambda: ChannelEdit(" ", ((0.0, 1.0),)), "an edit needs a channel"),
        (lambda: GazeTarget(0.0, 50.0, 0.0, 1.0), "the gaze left in degrees must lie between -35 and 35, not 50"),
        (lambda: GazeTarget(0.0, 5.0, 1.0, 1.0), "the gaze must end after it begins"),
        (lambda: Timeline(seeds={"head": -1}), "the seed of head must be 0 or more, not -1"),
        (lambda: Timeline(seeds={"ears": 1}), "no feature 'ears'"),
        (lambda: Timeline(gaze=(GazeTarget(0, 0, 0, 2), GazeTarget(0, 0, 1, 3))), "two spans of the gaze overlap"),
        (
            lambda: Timeline(strengths=(StrengthCurve("head", ((0.0, 1.0),)), StrengthCurve("head", ((1.0, 1.0),)))),
            "head has 2 curves of one kind",
        ),
    ],
)
def test_what_cannot_be_is_refused(make, reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        make()


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ('{"gaze": [{"down_deg": 1, "start": 0}]}', r"gaze\[0\]: left_deg is missing"),
        (
            '{"strengths": [{"feature": "head", "keys": 1}]}',
            r"strengths\[0\]: keys must be a list in square brackets, not 1",
        ),
        (
            '{"curves": [{"expression": "sad", "keys": [[0]]}]}',
            r"curves\[0\]: keys\[0\] must be \[seconds, value\], not \[0\]",
        ),
        (
            '{"edits": [{"channel": "jawOpen", "keys": [[0, "a"]]}]}',
            r'edits\[0\]: keys\[0\]\[1\] must be a number, not "a"',
        ),
        ('{"seeds": {"head": 1.5}}', r"seeds: head must be a whole number, not 1\.5"),
        ('{"seeds": [1]}', r"seeds: give an object in curly brackets, not \[1\]"),
    ],
)
def test_files_that_are_wrong_are_refused(content: str, reason: str) -> None:
    with pytest.raises(DataError, match=reason):
        parse_timeline(content)


def test_every_feature_has_a_strength() -> None:
    for feature in FEATURES:
        assert Timeline(strengths=(StrengthCurve(feature, ((0.0, 0.5),)),)).strength(feature, [0.0, 9.0]).tolist() == [
            0.5,
            0.5,
        ]
