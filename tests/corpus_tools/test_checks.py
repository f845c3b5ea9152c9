"""Limits of recordings, on made values."""

import numpy as np
import pytest

from corpus_tools.recordings.limits import (
    LIMITS,
    check_limits,
    head_turn_deg,
    landmark_measures,
    light_measures,
    limit_warnings,
    picture_measures,
    sound_measures,
)
from corpus_tools.recordings.video import NOT_COUNTED
from lexicon.errors import DataError
from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.types import Waveform

GOOD = {
    "fit": 0.98, "clipped": 0.0, "snr_db": 30.0, "crowded": 0.0, "turn_deg": 6.0, "frozen_s": 0.04,
    "frame_rate": 25.0, "eye_px": 65.0, "jitter": 0.1, "sync": 0.7, "sync_of_short": 0.6,
    "brightness": 120.0, "glare": 0.0, "contrast": 90.0, "sharpness": 0.04,
}  # fmt: skip
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
        ("fit", 0.41, r"does not match the transcript \(41% of it is heard, limit 60%\)"),
        ("recognised", 0.41, r"could not be recognised well \(41% of them are sure, limit 60%\)"),
        ("clipped", 0.35, r"35\.0% of the speech is clipped, limit 30\.0%"),
        ("snr_db", 4.0, "speech is 4 dB above the noise, limit 6 dB"),
        ("crowded", 0.5, "50% of the frames show more than one face, limit 25%"),
        ("turn_deg", 60.0, "turned away by 60 degrees, limit 30 degrees"),
        ("brightness", 10.0, r"the face is dark \(brightness 10 of 255, limit 15\)"),
        ("glare", 0.9, "90% of the face is overexposed, limit 80%"),
        ("contrast", 3.0, r"little contrast \(3 of 255 levels, limit 5\)"),
        ("sharpness", 0.012, r"the face is blurred \(sharpness 0\.012, limit 0\.016\)"),
        ("frozen_s", 0.5, r"is frozen for 0\.50 s, limit 0\.30 s"),
        ("frame_rate", 7.5, r"gives 8 pictures a second, limit 10; add light"),
        ("eye_px", 9.0, "eye corners are 9 px apart, limit 12 px"),
        ("jitter", 0.7, r"jitter by 0\.70 of their motion, limit 0\.50"),
        ("sync", 0.1, r"correlation 0\.10, limit 0\.25"),
        ("sync_of_short", 0.1, r"correlation 0\.10, limit 0\.15"),
    ],
)
def test_a_measure_beyond_its_limit_is_refused(measure: str, value: float, reason: str) -> None:
    with pytest.raises(DataError, match=reason):
        check_limits({**GOOD, measure: value})


@pytest.mark.parametrize(
    ("measure", "value", "reason"),
    [
        ("snr_db", 10.0, "speech is 10 dB above the noise, limit 20 dB; record in a quieter room"),
        ("clipped", 0.02, "2.0% of the speech is clipped, limit 0.5%; record it again with less gain"),
        ("turn_deg", 25.0, "the face is turned away by 25 degrees, limit 20 degrees; film it from the front"),
    ],
)
def test_a_measure_between_its_limits_is_a_warning(measure: str, value: float, reason: str) -> None:
    assert limit_warnings(GOOD) == ()
    check_limits({**GOOD, measure: value})
    assert limit_warnings({**GOOD, measure: value}) == (reason,)


def test_every_limit_is_checked_and_warns_before_it_refuses() -> None:
    assert {limit.measure for limit in LIMITS} == {*GOOD, "recognised"}
    assert all((limit.warning > limit.refusal) == limit.is_minimum for limit in LIMITS)


def test_jitter_is_the_noise_over_the_motion() -> None:
    """10 %: a median of 400 second differences. Noise .1 of the deviation of a slow opening."""
    times = np.arange(400) / 25
    opening = np.sin(2 * np.pi * 0.5 * times) / np.sqrt(0.5) + np.random.default_rng(0).normal(0, 0.1, 400)
    landmarks = np.zeros((400, 478, 3))
    landmarks[:, 33, 0], landmarks[:, 263, 0], landmarks[:, 13, 1] = -45, 45, 20 + opening
    found = landmark_measures(0.5 * landmarks, landmarks)
    assert found == {"eye_px": 45.0, "jitter": pytest.approx(0.1, rel=0.1)}


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


def test_the_light_of_a_recording_is_the_median_of_its_span() -> None:
    light = np.array([[0.0, 10, 90, 0, 0.1], [0.5, 100, 90, 0, 0.1], [1.0, 120, 90, 0, 0.1], [1.5, 140, 90, 0, 0.1]])
    found = light_measures(light, 0.4, 1.6)
    assert found == {"brightness": 120.0, "contrast": 90.0, "glare": 0.0, "sharpness": 0.1}
    assert light_measures(light, 1.1, 1.2)["brightness"] == 120.0  # shorter than the interval: the nearest
    assert light_measures(light[:0], 0.0, 1.0) == {}


def test_faces_and_still_pictures() -> None:
    counted = np.full(20, NOT_COUNTED, np.int8)
    counted[[0, 5, 10, 15]] = (1, 2, 0, 1)
    changes = np.full(20, 0.8, np.float32)
    changes[7:11] = 0.0  # five pictures alike
    found = picture_measures(counted, changes, np.arange(20) / 25)
    assert found == {"crowded": 0.25, "frozen_s": pytest.approx(4 / 25), "frame_rate": pytest.approx(25.0)}


def test_a_picture_that_always_moves_is_not_frozen() -> None:
    found = picture_measures(np.full(3, NOT_COUNTED, np.int8), np.full(3, np.inf, np.float32), np.arange(3) / 25)
    assert found == {"crowded": 0.0, "frozen_s": 0.0, "frame_rate": pytest.approx(25.0)}


def test_the_angle_between_face_and_camera() -> None:
    assert head_turn_deg(np.radians([[0.0, 50.0, 30.0]])) == pytest.approx(50.0)
    assert head_turn_deg(np.radians([[40.0, 0.0, 0.0]])) == pytest.approx(40.0)
    assert head_turn_deg(np.radians([[45.0, 45.0, 0.0]])) == pytest.approx(60.0)
