"""Limits of recordings, on made values."""

import numpy as np
import pytest

from corpus_tools.recordings.corpus_video import NOT_COUNTED
from corpus_tools.recordings.limits import LIMITS, check_limits, head_turn_deg, picture_measures, sound_measures
from lexicon.errors import DataError
from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.types import Waveform

GOOD = {"confidence": -3700.0, "clipped": 0.0, "snr_db": 30.0, "crowded": 0.0, "turn_deg": 6.0, "frozen_s": 0.04}
PHONES = PhoneSequence([SILENCE, "a", SILENCE], [0.0, 1.0, 2.0, 3.0])
RATE = 16_000


def sound(speech: float, noise: float) -> Waveform:
    levels = np.repeat([noise, speech, noise], RATE)
    return Waveform(np.clip(np.random.default_rng(0).normal(0, 1, 3 * RATE) * levels, -1, 1), RATE)


def test_good_measures_pass() -> None:
    check_limits(GOOD)


@pytest.mark.parametrize(
    ("measure", "value", "reason"),
    [
        ("confidence", -7300.0, "does not match the transcript"),
        ("recognised", -7300.0, "could not be recognised well"),
        ("clipped", 0.02, r"2\.0% of the speech is clipped"),
        ("snr_db", 6.0, "speech is 6 dB above the noise"),
        ("crowded", 0.5, "50% of the frames show more than one face"),
        ("turn_deg", 60.0, "turned away by 60 degrees"),
        ("frozen_s", 0.5, r"is frozen for 0\.50 s"),
    ],
)
def test_a_measure_beyond_its_limit_is_refused(measure: str, value: float, reason: str) -> None:
    with pytest.raises(DataError, match=reason):
        check_limits({**GOOD, measure: value})


def test_every_limit_is_checked() -> None:
    assert {limit.measure for limit in LIMITS} == {*GOOD, "recognised"}


@pytest.mark.parametrize(("noise", "expected"), [(0.001, 40.0), (0.01, 20.0), (0.1, 0.0)])
def test_the_ratio_of_speech_to_noise(noise: float, expected: float) -> None:
    """1 dB: the noise is read from its quieter windows."""
    assert sound_measures(sound(0.1, noise), PHONES)["snr_db"] == pytest.approx(expected, abs=1.0)


def test_clipped_speech_is_counted_and_clipped_silence_is_not() -> None:
    samples = np.full(3 * RATE, 0.5, np.float32)
    samples[: RATE // 2] = 1.0
    samples[RATE : RATE + RATE // 10] = -1.0
    assert sound_measures(Waveform(samples, RATE), PHONES)["clipped"] == pytest.approx(0.1)


def test_without_a_pause_the_signal_to_noise_ratio_is_infinite() -> None:
    assert sound_measures(sound(0.1, 0.1), PhoneSequence(["a"], [0.0, 3.0]))["snr_db"] == np.inf


def test_faces_and_still_pictures() -> None:
    counted = np.full(20, NOT_COUNTED, np.int8)
    counted[[0, 5, 10, 15]] = (1, 2, 0, 1)
    changes = np.full(20, 0.8, np.float32)
    changes[7:11] = 0.0  # five pictures alike
    found = picture_measures(counted, changes, np.arange(20) / 25)
    assert found == {"crowded": 0.25, "frozen_s": pytest.approx(4 / 25)}


def test_a_picture_that_always_moves_is_not_frozen() -> None:
    found = picture_measures(np.full(3, NOT_COUNTED, np.int8), np.full(3, np.inf, np.float32), np.arange(3) / 25)
    assert found == {"crowded": 0.0, "frozen_s": 0.0}


def test_the_angle_between_face_and_camera() -> None:
    assert head_turn_deg(np.radians([[0.0, 50.0, 30.0]])) == pytest.approx(50.0)
    assert head_turn_deg(np.radians([[40.0, 0.0, 0.0]])) == pytest.approx(40.0)
    assert head_turn_deg(np.radians([[45.0, 45.0, 0.0]])) == pytest.approx(60.0)
