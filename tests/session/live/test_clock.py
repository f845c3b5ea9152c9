"""The clock of a reader: no drift, no burst."""

import pytest

from tts2face.session.live.clock import MAX_LAG_S, FrameClock


def test_frames_are_due_at_multiples_from_the_first_one() -> None:
    """However long a reader takes for each, as long as it keeps up."""
    now = 100.0
    clock = FrameClock(30.0, lambda: now)
    for number in range(18_000):  # ten minutes
        now += clock.wait_s()
        assert now == pytest.approx(100.0 + (number + 1) / 30.0, abs=1e-6)
        now += 0.02 * (number % 2)


def test_after_a_long_pause_the_clock_goes_on_from_then() -> None:
    now = 0.0
    clock = FrameClock(30.0, lambda: now)
    now += clock.wait_s()
    now += 10 * MAX_LAG_S
    assert clock.wait_s() == 0.0
    assert clock.wait_s() == pytest.approx(1 / 30.0)


def test_a_short_pause_is_made_up_for() -> None:
    now = 0.0
    clock = FrameClock(30.0, lambda: now)
    now += clock.wait_s() + 0.1
    waits = [clock.wait_s() for _ in range(4)]
    assert waits[:2] == [0.0, 0.0]
    assert waits[3] > 0.0
