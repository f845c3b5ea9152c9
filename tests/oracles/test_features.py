"""Features of made sounds with known answers; pieces against the whole."""

import numpy as np
import pytest
from scipy.signal import lfilter

from lexicon.errors import InputError
from tts2face.sound import features
from tts2face.sound.features import FEATURE_KINDS, FEATURE_RATE, line_spectral_frequencies, speech_features
from tts2face.types import Waveform

VOWEL_HZ = (700.0, 1220.0, 2600.0, 3500.0, 4500.0, 5500.0, 6500.0, 7500.0)  # an open vowel


def vowel(seconds: float = 1.0) -> Waveform:
    """Glottal pulses at 110 Hz through eight resonances."""
    pulses = np.zeros(round(seconds * FEATURE_RATE))
    pulses[:: FEATURE_RATE // 110] = 1.0
    for hertz in VOWEL_HZ:
        radius = np.exp(-np.pi * 80.0 / FEATURE_RATE)
        pulses = lfilter([1.0], [1.0, -2 * radius * np.cos(2 * np.pi * hertz / FEATURE_RATE), radius**2], pulses)
    pulses = lfilter([1.0], [1.0, -0.97], pulses)  # removed by pre-emphasis
    return Waveform(0.5 * pulses / np.abs(pulses).max(), FEATURE_RATE)


def babble(seconds: float) -> Waveform:
    generator = np.random.default_rng(4)
    noise = generator.normal(0, 0.1, round(seconds * FEATURE_RATE))
    loud = np.repeat(generator.uniform(0, 1, len(noise) // 800 + 1), 800)[: len(noise)]
    return Waveform(np.clip(noise * loud, -1, 1), FEATURE_RATE)


def unstable_free_filters(n: int, order: int) -> np.ndarray:
    """(n, order) prediction coefficients whose roots lie inside the unit circle, two by two conjugate."""
    generator = np.random.default_rng(2)
    radii, angles = generator.uniform(0.3, 0.99, (n, order // 2)), generator.uniform(0.05, 3.09, (n, order // 2))
    roots = radii * np.exp(1j * angles)
    return np.stack([np.poly(np.concatenate([row, row.conj()])).real[1:] for row in roots])


def test_formants_of_a_made_vowel_are_found() -> None:
    found = speech_features(vowel(), "formants", fps=25, n_frames=20, start=0.1).values
    assert np.abs(np.median(found, axis=0) - VOWEL_HZ[:4]).max() < 60  # Hz; harmonics lie 110 apart


def test_prediction_finds_the_filter_that_made_the_sound() -> None:
    """The spectrum of the prediction filter peaks where the resonances are."""
    found = features.lpc(features.analysis_windows(vowel().samples, np.array([8000])))[0]
    angles = np.linspace(0, np.pi, 2000)
    response = 1 / np.abs(np.exp(-1j * np.outer(angles, np.arange(17))) @ np.concatenate([[1], found]))
    peaks = angles[1:-1][(response[1:-1] > response[:-2]) & (response[1:-1] > response[2:])] * FEATURE_RATE / 2 / np.pi
    for hertz in VOWEL_HZ[:4]:
        assert np.abs(peaks - hertz).min() < 80


@pytest.mark.parametrize("order", [2, 4, 10, 16])
def test_line_spectral_frequencies_are_the_angles_of_the_polynomials_roots(order: int) -> None:
    filters = unstable_free_filters(50, order)
    found = line_spectral_frequencies(filters)
    for row, angles in zip(filters, found, strict=True):
        whole = np.concatenate([[1.0], row, [0.0]])
        roots = np.concatenate([np.roots(whole + whole[::-1]), np.roots(whole - whole[::-1])])
        expected = np.sort(np.angle(roots))
        expected = expected[(expected > 1e-6) & (expected < np.pi - 1e-6)]
        np.testing.assert_allclose(angles, expected, atol=1e-6)  # rad; nearly double roots are good to half the digits


def test_an_odd_number_of_coefficients_is_refused() -> None:
    with pytest.raises(InputError, match="even number of coefficients above 0, not 3"):
        line_spectral_frequencies(np.zeros((1, 3)))


@pytest.mark.parametrize("kind", FEATURE_KINDS)
@pytest.mark.parametrize("fps", [25.0, 29.97])
def test_pieces_are_the_whole(kind: str, fps: float) -> None:
    sound = babble(3.0)
    whole = speech_features(sound, kind, fps=fps, n_frames=70).values
    assert np.isfinite(whole).all()
    parts = []
    for first, n in ((0, 1), (1, 30), (31, 39)):
        cut = max(0, round(first / fps * FEATURE_RATE) - features.HALF_WINDOW_SAMPLES)
        rest = round((first + n) / fps * FEATURE_RATE) + features.HALF_WINDOW_SAMPLES
        part = features.MEASURES[kind](
            features.analysis_windows(
                sound.samples[cut:rest], np.rint((first + np.arange(n)) / fps * FEATURE_RATE).astype(int) - cut
            )
        )
        parts.append(part.astype(np.float32))
    np.testing.assert_array_equal(features.channel_adaptation(kind)(np.concatenate(parts)), whole)


@pytest.mark.parametrize("kind", FEATURE_KINDS)
def test_silence_and_the_ends_of_a_sound_have_features(kind: str) -> None:
    values = speech_features(Waveform(np.zeros(1000), FEATURE_RATE), kind, fps=25, n_frames=50, start=-0.5).values
    assert np.isfinite(values).all()
    if kind != "mel":  # which follows the mean
        np.testing.assert_array_equal(values[0], values[-1])


def test_mel_features_do_not_depend_on_level_and_microphone() -> None:
    """Speech at other levels by another microphone has the same features, after a second."""
    from scipy.signal import lfilter

    sound = babble(4.0)
    plain = speech_features(sound, "mel", fps=25, n_frames=100).values[25:]
    other = Waveform(0.2 * lfilter([1.0, -0.5], [1.0], sound.samples), sound.rate)
    moved = speech_features(other, "mel", fps=25, n_frames=100).values[25:]
    assert np.abs(moved - plain).mean() < 0.35 * plain.std()
    places = np.arange(16_000, 64_000, 640)
    one, two = (features.mel(features.analysis_windows(each.samples, places)) for each in (sound, other))
    assert np.abs(one - two).mean() > 3 * np.abs(moved - plain).mean()


def test_the_level_is_that_of_the_sound() -> None:
    tone = Waveform(0.1 * np.sin(2 * np.pi * 500 * np.arange(16000) / 16000), FEATURE_RATE)
    found = features.level(features.analysis_windows(tone.samples, np.array([8000])))
    assert found[0, 0] == pytest.approx(20 * np.log10(0.1 / np.sqrt(2)), abs=0.05)


@pytest.mark.parametrize(
    ("kind", "rate", "reason"), [("pitch", FEATURE_RATE, "no feature 'pitch'"), ("mfcc", 8000, "16000 Hz, not 8000")]
)
def test_what_cannot_be_measured_is_refused(kind: str, rate: int, reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        speech_features(Waveform(np.zeros(8000), rate), kind, fps=25, n_frames=10)


def test_silence_before_the_speech_does_not_count_into_its_mean() -> None:
    speech = np.random.default_rng(4).normal(0.0, 0.1, 3 * FEATURE_RATE).astype(np.float32)
    muted = np.concatenate([np.zeros(20 * FEATURE_RATE, np.float32), speech])
    plain, late = (
        speech_features(Waveform(samples, FEATURE_RATE), "mel", fps=25, n_frames=75, start=start).values
        for samples, start in ((speech, 0.0), (muted, 20.0))
    )
    whole = speech_features(Waveform(muted, FEATURE_RATE), "mel", fps=25, n_frames=575).values
    np.testing.assert_allclose(whole[505:], plain[5:], atol=1e-3)
    np.testing.assert_allclose(late[5:], plain[5:], atol=1e-3)
