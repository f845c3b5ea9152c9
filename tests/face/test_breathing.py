"""Shoulders that breathe with speech."""

import numpy as np
import pytest

from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.face.breathing import BREATH_SHAPE, REST_CYCLE_S, Breathing, phrase_starts
from tts2face.types import Trajectory

CHANNELS = ("jawOpen", BREATH_SHAPE)
FPS = 30.0
BREATHING = Breathing.of_channels(CHANNELS)
SPEECH = PhoneSequence(
    [SILENCE, "a", "m", SILENCE, "a", SILENCE, "m", "a"], [0, 0.3, 1.4, 2.0, 2.5, 3.5, 3.6, 4.6, 6.0]
)


def breathed(phones: PhoneSequence, seconds: float, before=None, seed: int = 0):
    still = Trajectory(CHANNELS, np.zeros((round(seconds * FPS), 2), np.float32), FPS)
    moved, after = BREATHING.apply(still, phones, seed, before)
    assert moved.values[:, 0] == pytest.approx(0)
    return moved.values[:, 1], after


def test_phrases_begin_after_pauses_and_at_the_beginning() -> None:
    assert phrase_starts(SPEECH) == [0.3, 2.5]  # .1 s of silence is none
    assert phrase_starts(PhoneSequence(["a"], [0, 1])) == [0.0]


def test_shoulders_rise_before_a_phrase_and_sink_in_it() -> None:
    level, _ = breathed(SPEECH, 6.0)
    at = lambda second: level[round(second * FPS)]  # noqa: E731
    assert at(2.5) > 0.9
    assert at(2.5) - at(2.05) > 0.2
    assert (np.diff(level[round(2.6 * FPS) : round(5.0 * FPS)]) < 0).all()
    assert at(5.0) < 0.5
    assert np.abs(np.diff(level)).max() < 0.25
    assert ((level >= 0) & (level <= 1)).all()


def test_a_silent_face_breathes_twelve_to_eighteen_times_a_minute() -> None:
    silence = PhoneSequence([SILENCE], [0, 120])
    level, _ = breathed(silence, 120)
    rising = np.diff(level) > 0
    breaths = np.flatnonzero(rising[1:] & ~rising[:-1])
    gaps = np.diff(breaths) / FPS
    assert 12 <= 60 / gaps.mean() <= 18
    assert gaps.min() > REST_CYCLE_S[0] - 0.1
    assert gaps.std() > 0.1  # not a clock
    assert np.array_equal(level, breathed(silence, 120)[0])
    assert not np.array_equal(level, breathed(silence, 120, seed=1)[0])


def test_pieces_go_on_breathing() -> None:
    first, state = breathed(SPEECH, 3.0)
    later = PhoneSequence([SILENCE], [0, 20])
    second, _ = breathed(later, 20, state)
    assert abs(second[0] - first[-1]) < 0.1
    assert second.max() > 0.5


def test_a_face_without_the_shape_does_not_breathe() -> None:
    assert Breathing.of_channels(("jawOpen",)) is None
