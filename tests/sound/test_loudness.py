"""Level and pitch of known tones."""

import numpy as np
import pytest

from lexicon.errors import DataError
from tts2face.sound.praat import intensity, pitch
from tts2face.types import Waveform

RATE = 16_000


def _tone(hertz: float, seconds: float = 1.0) -> Waveform:
    return Waveform(np.sin(2 * np.pi * hertz * np.arange(round(seconds * RATE)) / RATE) * 0.1, RATE)


def test_level_of_a_known_tone():
    level = intensity(_tone(200), np.array([0.3, 0.5]))
    expected = 20 * np.log10(0.1 / np.sqrt(2) / 2e-5)  # dB against 20 micropascals, as Praat counts
    np.testing.assert_allclose(level, expected, atol=0.1)


def test_digital_silence_has_a_level():
    assert intensity(Waveform(np.zeros(RATE), RATE), np.array([0.5])).tolist() == [0.0]


def test_a_sound_too_short_for_a_level():
    with pytest.raises(DataError, match="too short to measure"):
        intensity(Waveform(np.zeros(50), RATE), np.array([0.0]))


def test_an_octave_has_twelve_semitones():
    low, high = _tone(150, 1.2), _tone(300, 0.8)
    both = Waveform(np.concatenate([low.samples, high.samples]), RATE)
    found = pitch(both, np.array([0.3, 0.6, 0.9, 1.5, 1.7]))
    np.testing.assert_allclose(found, [0, 0, 0, 12, 12], atol=0.05)  # semitones; Praat's own precision


def test_noise_and_silence_have_no_pitch():
    noise = 0.01 * np.random.default_rng(0).normal(size=RATE).clip(-3, 3)
    assert pitch(Waveform(np.zeros(RATE), RATE), np.array([0.2, 0.5])).tolist() == [0.0, 0.0]
    assert np.count_nonzero(pitch(Waveform(noise, RATE), np.linspace(0.1, 0.9, 50))) < 5


def test_a_sound_too_short_for_a_pitch():
    with pytest.raises(DataError, match="too short to have a pitch"):
        pitch(Waveform(np.zeros(50), RATE), np.array([0.0]))
