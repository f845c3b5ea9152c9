"""Loudness and true peak against the figures of ITU-R BS.1770-4 and against FFmpeg's meter."""

import numpy as np
import pytest

from lexicon.errors import InputError
from tests.oracles.loudness_meter import measure_loudness, true_peak
from tts2face.sound.loudness import ABSOLUTE_GATE_LUFS, integrated_loudness, k_weighting
from tts2face.types import Waveform


def sine(hertz: float, rate: int, *, seconds: float = 2.0, level: float = 1.0, phase: float = 0.0) -> Waveform:
    return Waveform(level * np.sin(2 * np.pi * hertz * np.arange(round(seconds * rate)) / rate + phase), rate)


def speechlike(rate: int, seed: int = 0) -> Waveform:
    """Noise modulated by syllables and pauses, so that both gates have an effect."""
    rng = np.random.default_rng(seed)
    times = np.arange(8 * rate) / rate
    noise = np.convolve(rng.normal(0.0, 0.1, len(times)), np.hanning(5) / 2, "same")
    syllables = np.square(np.sin(2 * np.pi * 2.3 * times)) * np.where(times % 3 < 2, 1.0, 0.02)
    return Waveform(np.clip(noise * syllables, -1, 1), rate)


def test_the_filters_are_those_of_the_tables() -> None:
    """BS.1770-4, annex 1, tables 1 and 2, at 48 kHz."""
    shelf, high_pass = k_weighting(48_000)
    np.testing.assert_allclose(shelf[0], [1.53512485958697, -2.69169618940638, 1.19839281085285], rtol=1e-12)
    np.testing.assert_allclose(shelf[1], [1.0, -1.69065929318241, 0.73248077421585], rtol=1e-12)
    np.testing.assert_allclose(high_pass[0], [1.0, -2.0, 1.0])
    np.testing.assert_allclose(high_pass[1], [1.0, -1.99004745483398, 0.99007225036621], rtol=1e-12)


@pytest.mark.parametrize("rate", [16_000, 22_050, 24_000, 48_000])
@pytest.mark.parametrize("level_db", [0.0, -20.0])
def test_a_sine_of_997_hz(rate: int, level_db: float) -> None:
    """BS.1770-4, annex 1: 0 dB of full scale in one front channel reads -3.01 LUFS."""
    tone = sine(997.0, rate, level=10 ** (level_db / 20))
    assert integrated_loudness([tone]) == pytest.approx(-3.01 + level_db, abs=0.05)  # LU; the standard allows 0.1


@pytest.mark.parametrize("rate", [16_000, 22_050, 24_000, 48_000])
def test_ffmpeg_s_meter_reads_the_same(rate: int) -> None:
    for seed in range(3):
        sound = speechlike(rate, seed)
        loudness, peak = measure_loudness(sound)
        assert integrated_loudness([sound]) == pytest.approx(loudness, abs=0.02)  # LU
        assert true_peak(sound) == pytest.approx(peak, abs=0.1)  # dB; another interpolation filter


def test_silence_is_gated() -> None:
    tone = sine(997.0, 24_000)
    late = Waveform(np.concatenate([np.zeros(48_000), tone.samples, np.zeros(240_000)]), 24_000)
    assert integrated_loudness([late]) == pytest.approx(
        integrated_loudness([tone]), abs=0.7
    )  # LU: three blocks either side are half silent
    assert integrated_loudness([Waveform(np.zeros(24_000), 24_000)]) == ABSOLUTE_GATE_LUFS
    assert integrated_loudness([]) == ABSOLUTE_GATE_LUFS


def test_sounds_together_are_weighed_by_their_length() -> None:
    loud, soft = sine(997.0, 24_000, seconds=3.1), sine(997.0, 24_000, seconds=1.3, level=0.5)
    blocks = np.repeat([1.0, 0.25], [28, 10])
    expected = integrated_loudness([loud]) + 10 * np.log10(blocks.mean())
    assert integrated_loudness([loud, soft]) == pytest.approx(expected, abs=0.02)


def test_a_sound_shorter_than_a_block_is_padded_with_silence() -> None:
    short = sine(997.0, 24_000, seconds=0.1)
    assert integrated_loudness([short]) == pytest.approx(-3.01 - 10 * np.log10(4), abs=0.05)


def test_the_peak_between_samples_is_found() -> None:
    """BS.1770-4, annex 2: at a quarter of the sample rate samples may lie 3 dB below the peak."""
    between = sine(12_000.0, 48_000, phase=np.pi / 4, level=0.5)
    ramp = np.minimum(np.arange(len(between.samples)), np.arange(len(between.samples))[::-1]) / 4800
    eased = Waveform(between.samples * np.minimum(ramp, 1.0), 48_000)
    assert 20 * np.log10(np.abs(eased.samples).max()) == pytest.approx(-9.03, abs=0.01)
    assert true_peak(eased) == pytest.approx(-6.02, abs=0.1)
    assert true_peak(Waveform(np.zeros(10), 48_000)) == -120.0


def test_rates_that_the_filters_do_not_fit_are_refused() -> None:
    with pytest.raises(InputError, match="needs a sample rate of 8000 Hz or more, not 2000"):
        integrated_loudness([sine(100.0, 2000)])
