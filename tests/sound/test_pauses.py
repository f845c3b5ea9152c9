"""Pauses in made sounds."""

from itertools import pairwise

import numpy as np
import pytest

from lexicon.errors import InputError
from tts2face.sound.pauses import (
    LEVEL_WINDOW_S,
    _window_levels,
    cut_at_pauses,
    find_pauses,
    is_near_speech,
    speech_level,
    speech_onset,
)
from tts2face.types import Waveform

RATE = 16_000


def speech_with_pauses(*lengths: float, level: float = 0.3, noise: float = 0.001) -> Waveform:
    """Noise bursts as loud as speech and pauses in turn, of these lengths in seconds."""
    generator = np.random.default_rng(0)
    parts = [
        generator.normal(0, level if number % 2 == 0 else noise, round(length * RATE))
        for number, length in enumerate(lengths)
    ]
    return Waveform(np.clip(np.concatenate(parts), -1, 1), RATE)


def test_pauses_are_found_and_closures_are_not() -> None:
    found = find_pauses(speech_with_pauses(1.0, 0.5, 1.0, 0.1, 1.0, 0.3, 1.0))
    assert np.array(found) == pytest.approx(np.array([[1.0, 1.5], [3.6, 3.9]]), abs=0.03)


@pytest.mark.parametrize("noise", [0.0001, 0.03])
def test_the_level_of_the_noise_does_not_matter(noise: float) -> None:
    assert np.array(find_pauses(speech_with_pauses(1.0, 0.5, 1.0, noise=noise))) == pytest.approx(
        np.array([[1.0, 1.5]]), abs=0.03
    )


def test_even_noise_has_no_pause() -> None:
    assert find_pauses(speech_with_pauses(3.0)) == ()


def test_stretches_are_cut_in_the_middle_of_the_longest_pause() -> None:
    found = cut_at_pauses(speech_with_pauses(3.0, 0.3, 2.0, 0.6, 3.0, 0.4, 4.0), longest=8.0)
    assert np.array(found) == pytest.approx(np.array([[0, 5.6], [5.6, 13.3]]), abs=0.03)


def test_stretches_cover_the_sound_and_none_is_too_long() -> None:
    sound = speech_with_pauses(*[0.9, 0.25] * 40)
    found = cut_at_pauses(sound, longest=5.0)
    assert found[0][0] == 0.0
    assert found[-1][1] == sound.duration
    assert all(before[1] == after[0] for before, after in pairwise(found))
    assert max(end - begin for begin, end in found) <= 5.0


@pytest.mark.parametrize("lengths", [(3.0, 0.31, 2.0, 0.57, 3.013, 0.4, 4.0), (4.007, 0.06, 4.0), (0.9, 0.25) * 40])
def test_parts_begin_with_a_frame_of_the_whole(lengths: tuple[float, ...]) -> None:
    found = cut_at_pauses(speech_with_pauses(*lengths), longest=4.99)
    frames = np.array([start for start, _ in found]) * 50
    assert frames == pytest.approx(np.round(frames), abs=1e-6)
    assert max(end - begin for begin, end in found) <= 4.99


def test_speech_without_a_pause_is_cut_where_it_is_quietest() -> None:
    sound = speech_with_pauses(4.0, 0.06, 4.0)
    (_, cut), _ = cut_at_pauses(sound, longest=5.0)
    assert cut == pytest.approx(4.03, abs=0.04)


def test_a_short_sound_is_one_stretch() -> None:
    assert cut_at_pauses(speech_with_pauses(1.0), longest=5.0) == ((0.0, 1.0),)
    assert cut_at_pauses(Waveform(np.zeros(0), RATE), longest=5.0) == ((0.0, 0.0),)


def test_no_length() -> None:
    with pytest.raises(InputError, match="must be above 0 s"):
        cut_at_pauses(speech_with_pauses(1.0), longest=0)


def in_silence(sound: Waveform, seconds: float, noise: float = 0.0) -> Waveform:
    drawn = np.random.default_rng(9).normal(0.0, 1.0, round(seconds * sound.rate))
    quiet = np.float32(noise) * drawn.astype(np.float32)
    return Waveform(np.concatenate([quiet, sound.samples, quiet]), sound.rate)


@pytest.mark.parametrize(("seconds", "noise"), [(1.0, 0.0), (20.0, 0.0), (60.0, 0.0), (30.0, 1e-5)])
def test_the_level_of_speech_is_that_without_silence(seconds: float, noise: float) -> None:
    sound = speech_with_pauses(1.0, 0.5, 1.0, 0.3, 2.0, noise=0.003)
    levels, longer = (_window_levels(one)[:, None] for one in (sound, in_silence(sound, seconds, noise)))
    assert speech_level(longer, LEVEL_WINDOW_S, is_recording=True) == pytest.approx(
        speech_level(levels, LEVEL_WINDOW_S), abs=1.5
    )


@pytest.mark.parametrize("seconds", [1.0, 10.0, 60.0])
def test_pauses_of_speech_are_found_within_silence(seconds: float) -> None:
    sound = speech_with_pauses(1.0, 0.5, 1.0, 0.3, 2.0, noise=0.003)
    found = np.array(find_pauses(in_silence(sound, seconds)))[1:-1] - seconds
    assert found == pytest.approx(np.array(find_pauses(sound)), abs=0.03)


@pytest.mark.parametrize("seconds", [0.5, 5.0, 60.0])
def test_noise_after_silence_is_no_onset_of_a_recording(seconds: float) -> None:
    sound = speech_with_pauses(0.0, 0.5, 1.0, noise=0.003)
    found = speech_onset(in_silence(sound, seconds), is_recording=True)
    assert found == pytest.approx(seconds + 0.5, abs=0.03)


def test_long_silence_is_cut_beside_the_speech() -> None:
    sound = in_silence(speech_with_pauses(3.0, 0.3, 3.0), 30.0)
    spans = cut_at_pauses(sound, 20.0)
    assert any(start <= 30.0 and end >= 36.3 for start, end in spans)


@pytest.mark.parametrize("softer_db", [32.0, 36.0, 45.0])
@pytest.mark.parametrize("noise", [0.001, 0.02])
def test_pauses_of_speech_behind_a_jingle_are_found(softer_db: float, noise: float) -> None:
    speech = speech_with_pauses(*[1.0, 0.5] * 12, 1.0, level=0.2, noise=noise)
    loud = np.random.default_rng(0).uniform(-0.8, 0.8, 2 * speech.rate).astype(np.float32)
    joined = np.concatenate([loud, speech.samples / 0.2 * 0.45 * np.float32(10.0 ** (-softer_db / 20.0))])
    found = np.array(find_pauses(Waveform(joined, speech.rate)))
    assert found - 2.0 == pytest.approx(np.array(find_pauses(speech)), abs=0.03)


@pytest.mark.parametrize("softer_db", [20.0, 26.0, 29.0, 32.0])
def test_speech_behind_a_jingle_is_no_silence(softer_db: float) -> None:
    speech = speech_with_pauses(*[1.0, 0.5] * 12, 1.0)
    loud = np.random.default_rng(0).uniform(-0.8, 0.8, 2 * speech.rate).astype(np.float32)
    samples = np.concatenate([loud, speech.samples / np.abs(speech.samples).max() * 0.8 * 10.0 ** (-softer_db / 20.0)])
    levels = 10.0 * np.log10(np.square(samples.reshape(-1, speech.rate // 100)).mean(axis=1) + 1e-12)
    counted = is_near_speech(levels, 0.01)
    assert counted[3 * 100 :].mean() > 0.9
