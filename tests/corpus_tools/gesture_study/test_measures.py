"""Measures against values computed by hand."""

import numpy as np
import pytest

from corpus_tools.studies.gestures.blinks import blink_onsets, find_blinks
from corpus_tools.studies.gestures.measures import (
    autocorrelation,
    coverage,
    diversity,
    frame_midpoints,
    random_halves,
    ratio,
    spectrum,
    split_recordings,
    wasserstein,
)

FPS = 10.0
# Shut from 0 to 1 in two frames, to 0 again in four; open before and after.
ONE_BLINK = np.array([0, 0, 0, 0.5, 1, 0.75, 0.5, 0.25, 0, 0, 0])


def lengths(*frames: int) -> np.ndarray:
    return np.array(frames, np.int32)


def test_a_blink_by_hand():
    found = find_blinks(ONE_BLINK, lengths(11), FPS)
    # rises by .5 a frame: passes .2 at 2.4, full at 4; falls by .25 a frame: passes .2 at 4 + .8 / .25 = 7.2
    assert found.n == 1
    np.testing.assert_allclose(found.closing, [0.16])
    np.testing.assert_allclose(found.opening, [0.32])
    np.testing.assert_allclose(found.durations, [0.48])
    np.testing.assert_allclose(found.closing_speeds, [5.0])
    np.testing.assert_allclose(found.opening_speeds, [2.5])
    assert len(found.intervals) == 0
    assert found.per_minute == pytest.approx(60 / 1.1)


def test_both_lids_are_averaged():
    lids = np.stack([1.5 * ONE_BLINK, 0.5 * ONE_BLINK], axis=1)
    np.testing.assert_allclose(find_blinks(lids, lengths(11), FPS).closing, [0.16])


def test_onsets_lie_between_frames():
    np.testing.assert_allclose(blink_onsets(np.array([0.0, 0.4, 0.8, 0.0, 0.0, 1.0])), [1.25, 4.5])


def test_intervals_do_not_cross_recordings():
    twice = np.concatenate([ONE_BLINK, ONE_BLINK])
    np.testing.assert_allclose(find_blinks(twice, lengths(22), FPS).intervals, [1.1])
    apart = find_blinks(twice, lengths(11, 11), FPS)
    assert (apart.n, len(apart.intervals), len(apart.durations)) == (2, 0, 2)


@pytest.mark.parametrize(
    ("lids", "n_onsets", "n_courses"),
    [
        (ONE_BLINK[:6], 1, 0),  # ends while the lids open
        (ONE_BLINK[4:], 0, 0),  # begins with shut lids
        (0.45 * ONE_BLINK, 0, 0),  # a narrowed eye
        (np.array([0, 0, 1, 0.4, 1, 0, 0]), 2, 1),  # twice shut, but never open between
    ],
)
def test_which_blinks_count(lids, n_onsets, n_courses):
    found = find_blinks(lids, lengths(len(lids)), FPS)
    assert (found.n, len(found.durations)) == (n_onsets, n_courses)


def test_means_of_neighbours_stay_within_recordings():
    np.testing.assert_allclose(frame_midpoints(np.array([0, 2, 4, 10, 30]), lengths(3, 2)), [1, 3, 20])
    assert [part.tolist() for part in split_recordings(np.arange(5), lengths(3, 2))] == [[0, 1, 2], [3, 4]]


def test_distance_is_how_far_numbers_must_be_moved():
    assert wasserstein(np.array([0.0, 1.0]), np.array([2.0, 3.0])) == pytest.approx(2.0)
    assert wasserstein(np.array([0.0, 1.0]), np.array([1.0, 0.0])) == 0.0
    assert np.isnan(wasserstein(np.zeros(0), np.ones(3)))


def test_halves_contain_every_recording_once():
    made = list(random_halves(7, 20, np.random.default_rng(0)))
    assert len(made) == 20
    assert all(sorted([*one, *other]) == list(range(7)) for one, other in made)
    assert len({tuple(sorted(one)) for one, _ in made}) > 5


def test_a_spectrum_finds_a_wave_and_its_power():
    times = np.arange(640) / 32
    slow, fast = np.sin(2 * np.pi * 2 * times), 0.1 * np.sin(2 * np.pi * 10 * times)
    found = spectrum(np.stack([slow + 5, fast], axis=1), lengths(320, 320), 32.0)
    assert found.hz[np.argmax(found.power)] == 2.0
    step = found.hz[1] - found.hz[0]
    assert found.power.sum() * step == pytest.approx(0.5 + 0.005, rel=0.02)  # a sine's power is half its height squared
    assert found.fast_power == pytest.approx(0.005, rel=0.02)


def test_recordings_too_short_for_a_spectrum_have_none():
    assert np.isnan(spectrum(np.zeros((20, 1)), lengths(20), FPS).power).all()


def test_ratio():
    assert ratio(1.0, 4.0) == 0.25
    assert np.isnan(ratio(1.0, 0.0))


def test_diversity_by_hand():
    takes = [np.zeros((4, 1)), np.full((4, 1), 2.0)]  # 2 apart
    assert diversity([np.zeros((4, 1)), np.ones((4, 1))], takes) == pytest.approx(0.5)
    assert diversity([np.ones((4, 1)), np.ones((4, 1))], takes) == 0.0


def test_coverage_by_hand():
    assert coverage(np.array([2, 3, 3]), lengths(10), 1) == 0.4  # 1 to 4
    assert coverage(np.array([9]), lengths(10, 10), 2) == 0.15  # 7 to 9: not into the next recording
    assert coverage(np.arange(10), lengths(10), 0) == 1.0


def test_autocorrelation_of_a_loop_is_one_at_its_period():
    once = np.random.default_rng(0).normal(size=(50, 2))
    found = autocorrelation(np.tile(once, (8, 1)), 120)
    assert found[0] == 1.0
    np.testing.assert_allclose(found[[50, 100]], 1.0, atol=1e-9)
    assert np.abs(np.delete(found[1:], [49, 99])).max() < 0.6


def test_autocorrelation_is_the_sum_of_products():
    values = np.random.default_rng(1).normal(size=(40, 2))
    away = values - values.mean(axis=0)
    expected = [(away[: 40 - lag] * away[lag:]).sum() / (40 - lag) for lag in range(6)]
    np.testing.assert_allclose(autocorrelation(values, 5), np.array(expected) / expected[0], rtol=1e-12)
