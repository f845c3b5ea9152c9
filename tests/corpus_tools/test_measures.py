"""Measures of lips: opening, width, closures and their times."""

import numpy as np
import pytest

from corpus_tools.measures import lip_measures
from lexicon.errors import InputError
from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.lips import motion_measures as measures
from tts2face.models.landmarks import lip_opening, lip_width

SPEECH = PhoneSequence([SILENCE, "p", "ɑ", "s", SILENCE], [0.0, 0.4, 0.5, 0.7, 0.8, 1.2])


def landmarks(opening, width=50.0, eyes=80.0):
    points = np.zeros((len(opening), 478, 3))
    points[:, 14, 1] = -np.asarray(opening)
    points[:, 61, 0], points[:, 291, 0] = -width / 2, width / 2
    points[:, 33, 0], points[:, 263, 0] = -eyes / 2, eyes / 2
    return points


def test_opening_and_width_are_measured_in_eye_distances():
    points = landmarks([0.0, 8.0, 16.0])
    assert lip_opening(points).tolist() == [0.0, 0.1, 0.2]
    assert lip_width(points).tolist() == [0.625, 0.625, 0.625]


def test_scored_from_100_ms_before_speech_to_100_ms_after_it():
    assert measures.speech_frames(SPEECH, 60, 50.0) == slice(15, 46)  # 0.30 s to 0.90 s, both frames included


def test_silence_cannot_be_judged():
    with pytest.raises(InputError, match="without speech"):
        measures.speech_frames(PhoneSequence([SILENCE], [0.0, 1.0]), 25, 25.0)


def test_correlation_of_known_series():
    assert measures.correlation(np.array([1.0, 2.0, 3.0]), np.array([2.0, 4.0, 6.0])) == pytest.approx(1.0)
    assert measures.correlation(np.array([1.0, 2.0, 3.0]), np.array([3.0, 2.0, 1.0])) == pytest.approx(-1.0)
    assert measures.correlation(np.array([1.0, 2.0, 3.0, 4.0]), np.array([1.0, 3.0, 2.0, 4.0])) == pytest.approx(0.8)
    assert measures.correlation(np.array([1.0, 2.0, 3.0]), np.ones(3)) == 0.0


def test_pearson_of_whole_numbers_and_of_a_constant():
    assert measures.pearson(np.array([1, 2, 3]), np.array([2, 4, 6])) == pytest.approx(1.0)
    assert measures.pearson(np.array([1, 2, 3]), np.array([6, 4, 2])) == pytest.approx(-1.0)
    assert np.isnan(measures.pearson(np.ones(3), np.arange(3)))
    one, other = np.random.default_rng(0).normal(size=(2, 50))
    assert measures.pearson(one, other) == pytest.approx(np.corrcoef(one, other)[0, 1], rel=1e-12)


def test_range_ratio_is_the_ratio_of_spreads():
    assert measures.range_ratio(np.array([0.0, 2.0]), np.array([5.0, 6.0])) == pytest.approx(0.5)


def test_rmse_is_in_units_of_spread():
    real, made = np.zeros((2, 2)), np.array([[2.0, 0.0], [0.0, 6.0]])
    assert lip_measures.rmse_z(real, made, np.array([2.0, 3.0])) == pytest.approx(((1 + 4) / 4) ** 0.5)


def test_warping_cost_forgives_a_small_delay_and_divides_by_the_path():
    pulse = np.zeros((10, 1))
    pulse[4] = 1.0
    late = np.roll(pulse, 2, axis=0)
    assert measures.warping_cost(pulse, late, np.ones(1), 3) == 0.0
    # 4 frames lie beyond the band of 3: one pulse must be matched to stillness on either side.
    assert measures.warping_cost(pulse, np.roll(pulse, 4, axis=0), np.ones(1), 3) == pytest.approx(2 / 10)
    # Without a band neither the delay nor the length matters.
    assert measures.warping_cost(pulse, np.concatenate([np.zeros((4, 1)), pulse]), np.ones(1), None) == 0.0
    # Two still motions one spread apart: 10 pairs of distance 2 / 2.
    assert measures.warping_cost(np.zeros((10, 1)), np.full((10, 1), 2.0), np.full(1, 2.0), 3) == pytest.approx(1.0)


def test_the_least_opening_includes_a_margin_around_the_phone():
    opening = np.full(60, 1.0)
    opening[19] = 0.3  # 0.38 s: 20 ms before the p
    opening[40] = 0.1  # in the silence
    assert lip_measures.min_openings(opening, SPEECH, 50.0).tolist() == [0.3]
    opening[18] = 0.2  # 0.36 s: 40 ms before, too far
    assert lip_measures.min_openings(opening, SPEECH, 50.0).tolist() == [0.3]
    assert lip_measures.min_openings(opening, SPEECH, 50.0, ("m",)).tolist() == []


def test_open_vowels_are_read_in_their_middle():
    opening = np.arange(60) / 50.0  # equals its own time
    np.testing.assert_allclose(lip_measures.midpoint_openings(opening, SPEECH, 50.0), [0.6])


def test_open_vowels_are_classified():
    found = lip_measures.open_vowels()
    assert {"ɑ", "æ", "ɛ", "aɪ", "aʊ", "ʌ"} <= found
    assert not {"i", "u", "eɪ", "oʊ", "ə", "p", SILENCE} & found


def test_nine_of_ten_real_closures_lie_below_the_threshold():
    real = np.arange(1.0, 12.0)
    threshold = lip_measures.closure_threshold(real)
    assert threshold == 10.0
    assert (real <= threshold).mean() == pytest.approx(10 / 11)
    assert lip_measures.closure_threshold(np.array([])) == 0.0


def test_peaks_are_read_between_frames():
    times = np.arange(60) / 50.0
    for peak in (0.58, 0.613, 0.66):
        curve = 10 - 100 * (times - peak) ** 2
        assert lip_measures.peak_times(curve, SPEECH, 50.0) == pytest.approx([peak], abs=1e-6)


def test_a_curve_without_a_peak_in_the_vowel_has_none():
    rising = np.arange(60) / 60.0
    assert np.isnan(lip_measures.peak_times(rising, SPEECH, 50.0)).all()
