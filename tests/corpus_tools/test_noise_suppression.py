"""Noise suppression on made sounds."""

import numpy as np
import pytest

from corpus_tools.recordings.sound import level_range_db, suppress_noise
from tts2face.types import Waveform

RATE = 16_000


def tone_in_noise(noise: float) -> Waveform:
    """A tone of 0.3 s at every second, and noise of the given deviation."""
    times = np.arange(3 * RATE) / RATE
    tone = np.where(times % 1.0 < 0.3, 0.2 * np.sin(2 * np.pi * 440 * times), 0.0)
    return Waveform((tone + np.random.default_rng(0).normal(0, noise, len(times))).astype(np.float32), RATE)


def test_the_level_range() -> None:
    """1 dB: quantiles of levels. Power of the tone .02, of the noise 1e-4."""
    assert level_range_db(tone_in_noise(0.01)) == pytest.approx(23.0, abs=1.0)


def test_little_noise_changes_nothing() -> None:
    sound = tone_in_noise(0.003)
    assert suppress_noise(sound) is sound


def test_silence_and_short_sounds_change_nothing() -> None:
    for sound in (Waveform(np.zeros(RATE, np.float32), RATE), Waveform(np.full(10, 0.1, np.float32), RATE)):
        assert suppress_noise(sound) is sound


def test_noise_falls_and_the_tone_stays() -> None:
    noisy = tone_in_noise(0.05)
    cleaned = suppress_noise(noisy).samples
    quiet = (np.arange(len(cleaned)) / RATE % 1.0 > 0.5) & (np.arange(len(cleaned)) / RATE % 1.0 < 0.9)
    assert cleaned[quiet].std() < 0.2 * noisy.samples[quiet].std()
    tone = tone_in_noise(0.0).samples
    assert np.corrcoef(cleaned, tone)[0, 1] > 0.98 > np.corrcoef(noisy.samples, tone)[0, 1]
    assert len(cleaned) == len(tone)
