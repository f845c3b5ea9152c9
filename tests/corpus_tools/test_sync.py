"""Sound against picture, on made recordings."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from corpus_tools.recordings.audio_video_sync import (
    LIP_LEAD_S,
    MAX_LAG_S,
    corrected_timings,
    estimate_sync,
    estimate_sync_by_video,
)
from corpus_tools.recordings.observation import Observation, Timing

FPS = 25.0


@pytest.fixture
def make_take(make_observation: Callable[..., Observation]) -> Callable[..., Observation]:
    def made(name: str, lag: float, seconds: float = 60.0, fps: float = FPS, seed: int = 1) -> Observation:
        generator = np.random.default_rng(seed)
        knots = np.arange(-2.0, seconds + 2.0, 0.12)
        heights = generator.uniform(0.0, 20.0, len(knots))
        times = np.arange(round(seconds * fps)) / fps
        plain = make_observation(name, 0, len(times))
        landmarks = plain.landmarks.copy()
        landmarks[:, 14] = landmarks[:, 13]
        landmarks[:, 14, 1] -= np.interp(times, knots, heights)
        loudness = 50 + np.interp(times - lag - LIP_LEAD_S, knots, heights)
        return replace(plain, fps=fps, landmarks=landmarks, intensity=loudness.astype(np.float32))

    return made


@pytest.mark.parametrize("lag", [-0.2, 0.0, 0.093, 0.25])
def test_a_known_lag_is_found(make_take: Callable[..., Observation], lag: float) -> None:
    """5 ms: half a step, between which the peak is interpolated."""
    found = estimate_sync([make_take("a", lag)])
    assert found.lag == pytest.approx(lag, abs=0.005)
    assert found.correlation > 0.9
    assert found.problem is None


def test_lags_below_the_resolution_are_not_corrected(make_take: Callable[..., Observation]) -> None:
    assert estimate_sync([make_take("a", 0.02)]).lag_correction_s == 0.0
    assert estimate_sync([make_take("a", 0.06)]).lag_correction_s == pytest.approx(0.06, abs=0.005)
    assert estimate_sync([make_take("a", 0.02, seconds=600.0)]).lag_correction_s == pytest.approx(0.02, abs=0.005)
    assert estimate_sync([make_take("a", 0.2, seconds=10.0)]).lag_correction_s == 0.0


def test_unrelated_sound_is_reported(make_take: Callable[..., Observation]) -> None:
    seen, other = make_take("a", 0.0), make_take("b", 0.0, seed=2)
    fault = estimate_sync([replace(seen, intensity=other.intensity)]).problem
    assert fault is not None
    assert "does not match the sound" in fault


def test_a_lag_at_the_border_is_a_fault(make_take: Callable[..., Observation]) -> None:
    fault = estimate_sync([make_take("a", MAX_LAG_S)]).problem
    assert fault is not None
    assert "out of sync" in fault


def test_short_videos_are_taken_together_and_long_ones_alone(make_take: Callable[..., Observation]) -> None:
    short = [make_take(f"s{number}", 0.1, seconds=12.0, seed=number) for number in range(5)]
    long = make_take("long", -0.15)
    found = estimate_sync_by_video([*short, long])
    assert found[Path("long.mkv")].lag == pytest.approx(-0.15, abs=0.005)
    assert [found[one.video].seconds for one in short] == pytest.approx([60.0] * 5)
    wanted = corrected_timings([*short, long], found)
    assert wanted[Path("long.mkv")].lag == pytest.approx(-0.15, abs=0.005)
    assert wanted[short[0].video].lag == pytest.approx(0.1, abs=0.005)


def test_the_rate_of_most_frames_is_everybodys(make_take: Callable[..., Observation]) -> None:
    seen = [
        make_take("a", 0.0, fps=30.0),
        make_take("b", 0.0, seconds=90.0, fps=25.0),
        make_take("c", 0.0, 50.0, fps=30.0),
    ]
    assert corrected_timings(seen, estimate_sync_by_video(seen)) == {Path("b.mkv"): Timing(30.0, 0.0)}


def test_nothing_is_read_twice_without_a_lag(make_take: Callable[..., Observation]) -> None:
    seen = [make_take("a", 0.0), make_take("b", 0.01)]
    assert corrected_timings(seen, estimate_sync_by_video(seen)) == {}


def test_lips_that_do_not_move_give_no_lag(make_take: Callable[..., Observation]) -> None:
    seen = make_take("a", 0.1)
    still = replace(seen, landmarks=np.repeat(seen.landmarks[:1], len(seen.landmarks), axis=0))
    found = estimate_sync([still])
    assert (found.lag, found.lag_correction_s, found.problem) == (0.0, 0.0, None)
