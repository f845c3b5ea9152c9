"""Movements of named gestures: their table, sizes, durations and speeds."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lexicon.gesture_names import GESTURES
from lexicon.marked_text import GESTURE_SECONDS_LIMITS, GESTURE_SIZE_LIMITS
from tts2face.gestures.elements import GazeTarget, Gesture
from tts2face.gestures.movements import (
    MAX_HEAD_SPEED,
    USUAL_DIRECTIONS,
    TimedGesture,
    channel_values,
    gesture_end,
    head_turn,
    minimum_jerk,
    movement_table,
    pair_values,
    timed,
    turned_gaze,
)
from tts2face.gestures.timeline import Timeline
from tts2face.models.palette import EXPRESSIONS

TIMES = np.arange(0.0, 12.0, 0.005)
CHANNELS = {
    "head_pitch", "head_yaw", "head_roll", "head_share", "gaze", "lid", "lids", "brows_up", "brows_together", "mouth",
    "squint", "squints", "breath", *(name for name in EXPRESSIONS if name != "afraid"),
}  # fmt: skip
GESTURE = st.builds(
    Gesture,
    time=st.floats(0.0, 2.0),
    name=st.sampled_from([*GESTURES]),
    size=st.floats(*GESTURE_SIZE_LIMITS),
    seconds=st.none() | st.floats(GESTURE_SECONDS_LIMITS[0], 6.0),
)


def test_every_gesture_moves_known_channels_and_returns() -> None:
    table = movement_table()
    assert list(table) == list(GESTURES)
    assert {row.channel for rows in table.values() for row in rows} == CHANNELS
    for rows in table.values():
        assert len({row.channel for row in rows}) == len(rows)
        for row in rows:
            keys = row.keys(0.0, 1.0)
            assert keys[0].tolist() == [0.0, 0.0]
            assert keys[-1, 1] == 0.0
            assert (np.diff(keys[:, 0]) > 0).all()
            if row.hold:
                assert row.before[-1, 0] < row.behind[0, 0]
    directed = {name for name, rows in table.items() if any(row.channel in {"gaze", "lid"} for row in rows)}
    assert directed | {"tilt"} == set(USUAL_DIRECTIONS)


@given(GESTURE)
def test_no_gesture_turns_a_head_too_fast_or_leaves_a_step(gesture: Gesture) -> None:
    moving = timed((gesture,), TIMES)
    turn = np.degrees(head_turn(moving, TIMES))
    own = [row for row, _ in TimedGesture.of(gesture).movements if row.channel.startswith("head_")]
    bursts = 1.0 + max((np.pi * row.hz for row in own), default=0.0)  # of a laugh, on top of its movement
    assert np.abs(np.diff(turn, axis=0)).max() / 0.005 <= MAX_HEAD_SPEED * (1.0 + 0.3 * bursts) + 1e-6
    for channel in CHANNELS - {"gaze", "head_share"}:
        values = channel_values(moving, channel, TIMES)
        assert values[-1] == pytest.approx(0.0, abs=1e-9)
        # a change within 5 ms that is far less than the whole movement
        assert np.abs(np.diff(values)).max() <= 0.3 * np.ptp(values) + 1e-9


@pytest.mark.parametrize("name", GESTURES)
def test_a_gesture_lasts_as_long_as_it_says(name: str) -> None:
    usual = TimedGesture.of(Gesture(1.0, name)).duration
    assert usual == pytest.approx(GESTURES[name].seconds)
    assert gesture_end(Gesture(1.0, name, seconds=4.0)) == pytest.approx(5.0)
    assert TimedGesture.of(Gesture(1.0, name, seconds=0.9 * usual)).duration == pytest.approx(0.9 * usual)
    assert timed((Gesture(1.0, name),), TIMES[1.0 + usual < TIMES]) == []


def test_a_hold_is_longer_and_its_ends_are_not() -> None:
    times = np.arange(0.0, 6.0, 0.01)
    smile, long = (
        channel_values(timed((one,), times), "happy", times)
        for one in (Gesture(0, "smile"), Gesture(0, "smile", 1.0, 5.0))
    )
    np.testing.assert_allclose(long[times < 1.5], smile[times < 1.5])
    np.testing.assert_allclose(long[(times > 1.0) & (times < 4.0)], 0.75)
    np.testing.assert_allclose(long[times >= 4.5], smile[(times >= 2.0) & (times < 3.5)], atol=1e-9)


def test_a_large_nod_is_slower_and_as_deep() -> None:
    pitch = np.degrees(head_turn(timed((Gesture(1.0, "shake", 2.0, 0.3),), TIMES), TIMES))[:, 1]
    assert np.ptp(pitch) == pytest.approx(21.0, abs=0.2)
    assert np.abs(np.diff(pitch)).max() / 0.005 <= MAX_HEAD_SPEED + 1e-6


def test_overlapping_gestures_of_a_channel_are_not_added() -> None:
    pair = timed((Gesture(1.0), Gesture(1.0, "nod", 0.5)), TIMES)
    np.testing.assert_array_equal(head_turn(pair, TIMES), head_turn(timed((Gesture(1.0),), TIMES), TIMES))


def test_sides_are_the_persons_own() -> None:
    right = pair_values(timed((Gesture(1.0, "wink", left_deg=-15.0),), TIMES), "lid", TIMES)
    assert (right[:, 0].max(), right[:, 1].max()) == (0.0, 1.0)
    left = pair_values(timed((Gesture(1.0, "wink"),), TIMES), "lid", TIMES)
    np.testing.assert_array_equal(left[:, ::-1], right)
    np.testing.assert_array_equal(*pair_values(timed((Gesture(1.0, "blink"),), TIMES), "lid", TIMES).T)
    tilts = [head_turn(timed((Gesture(1.0, "tilt", left_deg=side),), TIMES), TIMES)[:, 2] for side in (15.0, -15.0)]
    np.testing.assert_array_equal(tilts[0], -tilts[1])


def test_a_look_reaches_its_direction_with_eyes_and_head() -> None:
    looks = timed((Gesture(1.0, "look_away", left_deg=-20.0, down_deg=8.0),), TIMES)
    gaze = np.degrees(turned_gaze(looks, TIMES, np.zeros((len(TIMES), 2))))
    held = (TIMES > 1.1) & (TIMES < 2.1)
    np.testing.assert_allclose(gaze[held], np.tile([8.0, -20.0], (held.sum(), 1)))
    head = np.degrees(head_turn(looks, TIMES))
    np.testing.assert_allclose(head[(TIMES > 1.45) & (TIMES < 2.2), :2].T, [[2.0], [-5.0]] * np.ones((2, 149)))
    at = Timeline(gaze=(GazeTarget(5.0, 5.0),), gestures=(Gesture(1.0, "look_at"),))
    seen = np.degrees(at.apply_gaze(TIMES, np.zeros((len(TIMES), 2))))
    np.testing.assert_allclose(seen[held], 0.0, atol=1e-9)
    np.testing.assert_allclose(seen[TIMES > 3.2], 5.0)


def test_a_timeline_keeps_what_still_lasts() -> None:
    long = Gesture(0.0, "smile", 1.0, 20.0)
    kept = Timeline(gestures=(long, Gesture(1.0), Gesture(9.0))).lasting(8.0)
    assert kept.gestures == (long, Gesture(9.0))


def test_minimum_jerk_is_that_of_its_polynomial() -> None:
    keys = np.array([[0.0, 0.0], [1.0, 2.0]])
    times = np.linspace(-0.5, 1.5, 201)
    within = times[(times >= 0) & (times <= 1)]
    found = minimum_jerk(times, keys)
    np.testing.assert_allclose(
        found[(times >= 0) & (times <= 1)], np.polyval([12, -30, 20, 0, 0, 0], within), atol=1e-12
    )
    assert (found[times < 0] == 0).all()
    assert (found[times > 1] == 2).all()
