"""Intensity beside Praat's, on speech and on sounds at the limits of its analysis window."""

import numpy as np
import parselmouth
import pytest

from tts2face.sound.espeak import EspeakVoice
from tts2face.sound.praat import intensity
from tts2face.types import Waveform


def _praat_levels(sound: Waveform) -> tuple[np.ndarray, np.ndarray]:
    samples = parselmouth.Sound(sound.samples.astype(float), sampling_frequency=sound.rate)
    levels = samples.to_intensity(minimum_pitch=100.0, subtract_mean=True)
    return levels.xs(), np.maximum(levels.values[0], 0.0)


@pytest.mark.parametrize(
    ("rate", "n_samples"),
    [(8000, 513), (16_000, 7000), (22_050, 1412), (24_000, 38_400), (24_000, 100_001), (44_100, 50_000)],
)
def test_noise_with_an_offset_and_a_gap(rate, n_samples):
    samples = np.random.default_rng(rate).normal(size=n_samples).cumsum()
    samples = 0.1 + 0.8 * samples / np.abs(samples).max()
    samples[n_samples // 2 : 2 * n_samples // 3] = 0.0
    sound = Waveform(samples.astype(np.float32), rate)
    times, expected = _praat_levels(sound)
    np.testing.assert_allclose(intensity(sound, times), expected, atol=2e-5, rtol=0)  # dB; float32


def test_a_sentence():
    sound = EspeakVoice("en-us", {}).speak("We were away a year ago, but Bob may move five big maps.").waveform
    times, expected = _praat_levels(sound)
    np.testing.assert_allclose(intensity(sound, times), expected, atol=2e-5, rtol=0)
