"""Durations, F0 and formants of finished sounds, of which all is known."""

import numpy as np
import parselmouth
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from tts2face.sound.psola import LEAST_S, Stretch, even_stretch, resynthesize
from tts2face.types import Waveform

RATE = 24_000
FORMANTS_HZ = (600.0, 1400.0, 2500.0)
UNCHANGED = even_stretch(1.0)


def buzz(f0: float, seconds: float = 1.0, resonances: tuple[float, ...] = FORMANTS_HZ) -> Waveform:
    """Pulses through resonances of 80 Hz."""
    pulses = np.zeros(round(seconds * RATE))
    pulses[:: round(RATE / f0)] = 1.0
    for hertz in resonances:
        radius = np.exp(-np.pi * 80.0 / RATE)
        pulses = lfilter([1.0], [1.0, -2 * radius * np.cos(2 * np.pi * hertz / RATE), radius**2], pulses)
    return Waveform(0.5 * pulses / np.abs(pulses).max(), RATE)


def praat(sound: Waveform) -> parselmouth.Sound:
    return parselmouth.Sound(sound.samples.astype(np.float64), sound.rate)


def median_f0(sound: Waveform) -> float:
    found = praat(sound).to_pitch_ac(pitch_floor=40.0, pitch_ceiling=600.0).selected_array["frequency"]
    return float(np.median(found[found > 0]))


def resonance(sound: Waveform) -> float:
    """Frequency in Hz around which the power lies."""
    power = np.square(np.abs(np.fft.rfft(sound.samples)))
    return float((np.fft.rfftfreq(len(sound.samples), 1 / RATE) * power).sum() / power.sum())


@pytest.mark.parametrize("f0", [70.0, 120.0, 220.0])
@pytest.mark.parametrize("semitones", [-4.0, 3.0])
def test_pitch_moves_by_what_is_asked(f0: float, semitones: float) -> None:
    sound = buzz(f0)
    factor = 2 ** (semitones / 12)
    moved = resynthesize(sound, UNCHANGED, lambda _, hertz: hertz * factor)
    assert len(moved.samples) == len(sound.samples)
    assert median_f0(moved) == pytest.approx(factor * median_f0(sound), rel=0.02)


@pytest.mark.parametrize("rate", [0.5, 1.25, 2.0])
def test_the_rate_keeps_pitch_and_formants(rate: float) -> None:
    sound = buzz(70.0)
    faster = resynthesize(sound, even_stretch(rate))
    assert faster.duration == pytest.approx(1.0 / rate, abs=1e-4)
    assert median_f0(faster) == pytest.approx(70.0, rel=0.02)


@pytest.mark.parametrize("factor", [0.86, 1.16])
def test_formants_move_alone(factor: float) -> None:
    sound = buzz(130.0, resonances=(1400.0,))
    moved = resynthesize(sound, UNCHANGED, formants=factor)
    assert moved.duration == sound.duration
    assert median_f0(moved) == pytest.approx(130.0, rel=0.02)
    assert resonance(moved) == pytest.approx(factor * resonance(sound), rel=0.03)


def test_nothing_clicks() -> None:
    """No step between samples is larger than those of the sound itself, scaled by its rise of formants."""

    def largest_step(samples: NDArray[np.float32]) -> float:
        return float(np.abs(np.diff(samples)).max())

    sound = buzz(120.0)
    for moved in (
        resynthesize(sound, even_stretch(1.5)),
        resynthesize(sound, UNCHANGED, lambda times, hertz: hertz * (1.0 + 0.5 * times)),
    ):
        assert largest_step(moved.samples) < 1.5 * largest_step(sound.samples)


def test_equal_arguments_give_equal_bytes() -> None:
    rng = np.random.default_rng(0)
    breathy = Waveform(0.5 * buzz(120.0).samples + 0.05 * rng.standard_normal(RATE), RATE)
    half = Waveform(breathy.samples * (np.arange(RATE) % 8000 < 4000), RATE)
    first, second = (resynthesize(half, even_stretch(1.4)) for _ in range(2))
    assert np.array_equal(first.samples, second.samples)


def test_sounds_that_are_too_short_or_unchanged_are_returned() -> None:
    short = buzz(200.0, 0.9 * LEAST_S)
    assert resynthesize(short, even_stretch(1.5)) is short
    sound = buzz(200.0)
    assert resynthesize(sound, UNCHANGED) is sound


def test_silence_and_noise_have_no_pitch_to_move() -> None:
    silence = Waveform(np.zeros(RATE), RATE)
    assert not resynthesize(silence, even_stretch(1.25), lambda _, hertz: 2 * hertz, 1.1).samples.any()


def test_times_move_with_the_stretch() -> None:
    stretch = Stretch(np.array([0.2, 0.3, 0.5, 0.6]), np.array([1.0, 2.0, 2.0, 1.0]))
    assert stretch.moved(np.array([0.0, 0.2, 0.3, 0.4, 0.6, 1.0])) == pytest.approx(
        np.array([0.0, 0.2, 0.35, 0.55, 0.9, 1.3])
    )
    fine = np.linspace(0, 1, 2001)
    summed = np.concatenate([[0.0], np.cumsum(np.interp((fine[1:] + fine[:-1]) / 2, stretch.times, stretch.factors))])
    assert stretch.moved(fine) == pytest.approx(summed * 5e-4, abs=1e-6)
