"""Sound against picture, on made recordings whose lips follow made expectations."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from corpus_tools.recordings.expected_opening import EXPECTED_RATE_HZ, shipped_talker_opening
from corpus_tools.recordings.observation import Observation, Timing
from corpus_tools.recordings.sync import MAX_LAG_S, SyncEstimate, corrected_timings, estimate_sync_by_video
from lexicon.sequence import SILENCE, PhoneSequence

FPS = 25.0
VOWELS = ("a", "i")


def made_phones(seconds: float, seed: int) -> PhoneSequence:
    """Vowels of random lengths."""
    lengths = np.random.default_rng(seed).uniform(0.08, 0.3, round(seconds * 12))
    edges = np.concatenate([[0.0], np.cumsum(lengths)])
    n_phones = int(np.searchsorted(edges, seconds)) - 1
    return PhoneSequence([VOWELS[at % 2] for at in range(n_phones)], edges[: n_phones + 1])


def expected(phones: PhoneSequence) -> np.ndarray:
    """An opening that is 1 in each a and 0 in each i, with linear transitions between their middles."""
    middles = (phones.edges[:-1] + phones.edges[1:]) / 2
    times = np.arange(0.0, phones.end, 1 / EXPECTED_RATE_HZ)
    return np.interp(times, middles, [float(label == "a") for label in phones.phones])


@pytest.fixture
def make_take(make_observation: Callable[..., Observation]) -> Callable[..., Observation]:
    def made(name: str, lag: float, seconds: float = 60.0, fps: float = FPS, seed: int = 1) -> Observation:
        phones = made_phones(seconds, seed)
        times = np.arange(round(seconds * fps)) / fps
        plain = make_observation(name, 0)
        landmarks = np.repeat(plain.landmarks[:1], len(times), axis=0)
        curve = expected(phones)
        lips = np.interp(times + lag, np.arange(len(curve)) / EXPECTED_RATE_HZ, curve)
        landmarks[:, 14] = landmarks[:, 13]
        landmarks[:, 14, 1] -= 10.0 * lips
        return replace(plain, fps=fps, landmarks=landmarks, phones=phones, head=np.zeros((len(times), 6), np.float32))

    return made


def estimate_one(observation: Observation) -> SyncEstimate:
    return estimate_sync_by_video([observation], expected)[observation.video]


@pytest.mark.parametrize("lag", [-0.4, -0.2, 0.0, 0.093, 0.25, 0.4])
def test_a_known_lag_is_found(make_take: Callable[..., Observation], lag: float) -> None:
    """5 ms: half a step, between which the peak is interpolated."""
    found = estimate_one(make_take("a", lag))
    assert found.lag == pytest.approx(lag, abs=0.005)
    assert found.correlation > 0.9
    assert found.problem is None
    assert found.warnings == ()


def test_insignificant_lags_are_not_corrected(make_take: Callable[..., Observation]) -> None:
    assert estimate_one(make_take("a", 0.02)).lag_correction_s == 0.0
    assert estimate_one(make_take("a", 0.06)).lag_correction_s == pytest.approx(0.06, abs=0.005)
    assert estimate_one(make_take("a", 0.06, seconds=3.0)).lag_correction_s == 0.0
    assert estimate_one(make_take("a", 0.09, seconds=3.0)).lag_correction_s == pytest.approx(0.09, abs=0.01)


@pytest.mark.parametrize("seconds", [20.0, 60.0])
def test_unrelated_sound_is_a_problem_at_any_length(make_take: Callable[..., Observation], seconds: float) -> None:
    seen, other = make_take("a", 0.0, seconds), make_take("b", 0.0, seconds, seed=2)
    found = estimate_one(replace(seen, phones=other.phones))
    assert found.problem is not None
    assert f"(correlation {found.pooled:.2f}, limit 0.25)" in found.problem
    assert found.lag_correction_s == 0.0


def test_a_short_clip_is_compared_at_the_lag_of_the_others(make_take: Callable[..., Observation]) -> None:
    """Its own best lag would match by chance."""
    others = [make_take(f"s{number}", 0.1, seconds=4.0, seed=number) for number in range(10)]
    wrong = replace(make_take("wrong", 0.1, seconds=4.0, seed=20), phones=made_phones(4.0, 21))
    found = estimate_sync_by_video([*others, wrong], expected)
    assert found[wrong.video].problem is not None
    assert "limit 0.15" in found[wrong.video].problem
    assert [found[one.video].problem for one in others] == [None] * 10


def test_weak_agreement_is_a_warning() -> None:
    weak = SyncEstimate(0.0, 0.3, 60.0, 0.3, 60.0)
    assert weak.problem is None
    assert weak.warnings == (
        "lip motion does not match the sound (correlation 0.30, limit 0.35); "
        "give the original sound or record it again",
    )


def test_a_clip_too_short_to_compare_is_a_warning(make_take: Callable[..., Observation]) -> None:
    found = estimate_one(make_take("a", 0.0, seconds=0.8))
    assert (found.problem, found.lag_correction_s) == (None, 0.0)
    assert "too few to compare" in found.warnings[0]


def test_a_lag_at_the_border_is_a_problem(make_take: Callable[..., Observation]) -> None:
    problem = estimate_one(make_take("a", MAX_LAG_S)).problem
    assert problem is not None
    assert "out of sync" in problem


def test_short_videos_are_taken_together_and_long_ones_alone(make_take: Callable[..., Observation]) -> None:
    short = [make_take(f"s{number}", 0.1, seconds=10.0, seed=number) for number in range(5)]
    long = make_take("long", -0.15)
    found = estimate_sync_by_video([*short, long], expected)
    assert found[Path("long.mkv")].lag == pytest.approx(-0.15, abs=0.005)
    assert [found[one.video].pooled_seconds for one in short] == pytest.approx([50.0] * 5)
    wanted = corrected_timings([*short, long], found)
    assert wanted[Path("long.mkv")].lag == pytest.approx(-0.15, abs=0.005)
    assert wanted[short[0].video].lag == pytest.approx(0.1, abs=0.005)


def test_the_rate_of_most_frames_is_everybodys(make_take: Callable[..., Observation]) -> None:
    seen = [
        make_take("a", 0.0, fps=30.0),
        make_take("b", 0.0, seconds=90.0, fps=25.0),
        make_take("c", 0.0, 50.0, fps=30.0),
    ]
    assert corrected_timings(seen, estimate_sync_by_video(seen, expected)) == {Path("b.mkv"): Timing(30.0, 0.0)}


def test_nothing_is_read_twice_without_a_lag(make_take: Callable[..., Observation]) -> None:
    seen = [make_take("a", 0.0), make_take("b", 0.01)]
    assert corrected_timings(seen, estimate_sync_by_video(seen, expected)) == {}


def test_lips_that_do_not_move_are_a_problem(make_take: Callable[..., Observation]) -> None:
    seen = make_take("a", 0.1)
    still = replace(seen, landmarks=np.repeat(seen.landmarks[:1], len(seen.landmarks), axis=0))
    found = estimate_one(still)
    assert (found.lag, found.lag_correction_s) == (0.0, 0.0)
    assert found.problem is not None


def test_the_shipped_talker_closes_its_lips_for_bilabials() -> None:
    phones = PhoneSequence([SILENCE, "ɑ", "p", "ɑ", SILENCE], [0.0, 0.4, 0.6, 0.7, 0.9, 1.2])
    opening = shipped_talker_opening(phones)
    assert opening[64] < 0.5 * min(opening[50], opening[80])


def test_a_few_seconds_are_not_refused_for_a_lag_that_they_cannot_show() -> None:
    few = SyncEstimate(0.5, 0.4, 3.0, 0.4, 3.0)
    assert few.problem is None
    assert few.lag_correction_s == 0.0
    assert any("3.0 s are too short" in warning for warning in few.warnings)
    assert "out of sync" in str(SyncEstimate(0.5, 0.4, 30.0, 0.4, 30.0).problem)
