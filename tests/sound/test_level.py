"""Every voice at one loudness, and no peak above the ceiling."""

import numpy as np
import pytest

from lexicon.sequence import SILENCE, PhoneSequence
from tests.oracles.loudness_meter import measure_loudness, true_peak
from tts2face.sound.level import CEILING_DB, LOOK_AHEAD_S, LOUDNESS_LUFS, level_speech, limit_peaks, normalise_loudness
from tts2face.sound.loudness import integrated_loudness, oversampled_peaks
from tts2face.types import Speech, Waveform

RATE = 24_000


def sound(level: float, seconds: float = 1.5, crest: float = 1.0, seed: int = 0) -> Waveform:
    """Noise of a level between silences, with pulses `crest` times as high as the level."""
    samples = np.random.default_rng(seed).normal(0.0, level, round(seconds * RATE))
    samples[:: RATE // 10] *= crest
    quiet = np.zeros(RATE // 4)
    return Waveform(np.clip(np.concatenate([quiet, samples, quiet]), -1.0, 1.0), RATE)


@pytest.mark.parametrize("level", [0.003, 0.03, 0.2])
@pytest.mark.parametrize("crest", [1.0, 8.0])
@pytest.mark.parametrize("seconds", [0.2, 3.0])
def test_loud_and_soft_voices_come_out_alike(level: float, crest: float, seconds: float) -> None:
    (levelled,) = normalise_loudness([sound(level, seconds, crest)])
    loudness, peak = measure_loudness(levelled)
    assert integrated_loudness([levelled]) == pytest.approx(LOUDNESS_LUFS, abs=0.3)
    assert loudness == pytest.approx(LOUDNESS_LUFS, abs=0.3)
    assert peak < -1.0


def test_utterances_of_a_sentence_keep_their_loudness_to_each_other() -> None:
    soft, loud = normalise_loudness([sound(0.01), sound(0.02)])
    assert integrated_loudness([soft, loud]) == pytest.approx(LOUDNESS_LUFS, abs=0.05)
    assert integrated_loudness([loud]) - integrated_loudness([soft]) == pytest.approx(6.02, abs=0.1)


def test_silence_stays_as_it_is() -> None:
    silent = Waveform(np.zeros(RATE), RATE)
    assert normalise_loudness([silent])[0].samples.tobytes() == silent.samples.tobytes()


def test_a_peak_is_turned_down_smoothly_and_its_surroundings_are_not() -> None:
    """The gain at the peak is ceiling / peak, 1 beyond the look-ahead, and changes slowly between."""
    tone = 0.5 * np.sin(2 * np.pi * 500 * np.arange(RATE) / RATE)
    loud = tone.copy()
    burst = slice(RATE // 2, RATE // 2 + RATE // 500)
    loud[burst] *= 4.0
    limited = limit_peaks(loud, RATE)
    assert true_peak(Waveform(np.clip(limited, -1, 1), RATE)) <= CEILING_DB + 0.01
    away = np.abs(np.arange(RATE) - RATE / 2) > (2 * LOOK_AHEAD_S + 0.004) * RATE
    np.testing.assert_array_equal(limited[away], tone[away].astype(np.float32))
    gain = limited[np.abs(loud) > 0.1] / loud[np.abs(loud) > 0.1]
    assert gain.min() == pytest.approx(10 ** (CEILING_DB / 20) / oversampled_peaks(loud).max(), rel=0.02)
    assert np.abs(np.diff(gain)).max() < 0.06  # of 1; clipping changes by .58 from one sample to the next


def test_the_loudness_of_a_request_is_relative() -> None:
    spoken = speech(sound(0.05))
    normal, half, twice = (level_speech([spoken], [np.array([gain])])[0].waveform for gain in (1.0, 0.5, 2.0))
    np.testing.assert_allclose(half.samples, 0.5 * normal.samples, rtol=1e-6)
    assert 4.0 < integrated_loudness([twice]) - LOUDNESS_LUFS < 6.1  # 6 dB less what the limiter takes
    assert true_peak(twice) <= CEILING_DB + 0.01


def speech(waveform: Waveform) -> Speech:
    return Speech(waveform, PhoneSequence([SILENCE], [0.0, waveform.duration]), ())
