"""Clock, gaps and cuts, on made values."""

import numpy as np
import pytest

from corpus_tools.recordings.observation import trim_to_picture
from corpus_tools.recordings.sound import AlignedSpeech
from lexicon.errors import DataError
from lexicon.sequence import SILENCE, PhoneSequence, WordSpan
from tts2face.types import Waveform
from tts2face.video.resampling import fill_gaps, resample_to_grid, trim_and_fill

FPS = 25.0


def _line(times: np.ndarray) -> np.ndarray:
    """(T, 2, 3) points that move in a straight line."""
    return (times[:, None, None] * np.arange(1, 7).reshape(1, 2, 3)).astype(np.float32)


def test_times_rounded_to_milliseconds_are_frames():
    times = np.round(np.arange(30) / 30, 3)
    points, first = resample_to_grid(_line(times), times, 30.0)
    assert first == 0
    np.testing.assert_array_equal(points, _line(times))


def test_uneven_times_are_put_on_even_ones():
    times = np.array([0.0, 0.03, 0.09, 0.11, 0.17, 0.2])
    points, first = resample_to_grid(_line(times), times, FPS)
    assert first == 0
    np.testing.assert_allclose(points, _line(np.arange(6) / FPS), atol=1e-6)


def test_a_late_start_keeps_its_place_on_the_clock():
    times = 0.5 + np.arange(10) / FPS
    points, first = resample_to_grid(_line(times), times, FPS)
    assert first == 13
    np.testing.assert_allclose(points, _line(np.arange(13, 13 + len(points)) / FPS), atol=1e-5)


def test_times_that_run_back():
    with pytest.raises(DataError, match="times of the frames do not increase"):
        resample_to_grid(_line(np.arange(3.0)), np.array([0.0, 0.08, 0.04]), FPS)


def test_blank_frames_at_the_ends_and_short_gaps():
    points = _line(np.arange(20) / FPS)
    whole = points.copy()
    points[[0, 1, 2, 9, 10, 19]] = np.nan
    filled, start, n_filled = trim_and_fill(points, FPS)
    assert (start, len(filled), n_filled) == (3, 16, 2)
    np.testing.assert_allclose(filled, whole[3:19], atol=1e-6)


def test_a_long_gap():
    points = _line(np.arange(20) / FPS)
    points[5:9] = np.nan
    with pytest.raises(DataError, match=r"no face is visible for 0\.16 s"):
        fill_gaps(points, FPS)


def _aligned_speech() -> AlignedSpeech:
    phones = PhoneSequence([SILENCE, "b", "i", SILENCE], [0.0, 1.0, 1.1, 1.5, 3.0])
    return AlignedSpeech(phones, (WordSpan("b", 1, 3),), 0.9, (), Waveform(np.zeros(100), 100), False)


def test_a_cut_moves_phones_and_pictures_together():
    phones, words = trim_to_picture(_aligned_speech(), 0.2, 2.0)
    assert phones.phones == (SILENCE, "b", "i", SILENCE)
    np.testing.assert_allclose(phones.edges, [0, 0.8, 0.9, 1.3, 1.8])
    assert words == (WordSpan("b", 1, 3),)


def test_a_removed_silence_has_no_phone():
    phones, words = trim_to_picture(_aligned_speech(), 1.0, 1.5)
    assert phones.phones == ("b", "i")
    np.testing.assert_allclose(phones.edges, [0, 0.1, 0.5])
    assert words == (WordSpan("b", 0, 2),)


@pytest.mark.parametrize(("begin", "stop"), [(1.05, 3.0), (0.0, 1.4)])
def test_words_without_a_face(begin, stop):
    with pytest.raises(DataError, match="there is speech while no face is visible"):
        trim_to_picture(_aligned_speech(), begin, stop)


def test_a_last_phone_slightly_longer_than_the_picture_is_cut():
    phones, words = trim_to_picture(_aligned_speech(), 1.0, 1.45)
    assert phones.phones == ("b", "i")
    np.testing.assert_allclose(phones.edges, [0, 0.1, 0.45])
    assert words == (WordSpan("b", 0, 2),)
