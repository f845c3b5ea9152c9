"""Pupils that fluctuate and widen with speech."""

import numpy as np

from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.face.pupils import DILATION, PUPIL_SHAPE, SPEECH, Pupils
from tts2face.types import Trajectory

FPS = 30.0
CHANNELS = ("jawOpen", PUPIL_SHAPE)


def dilated(phones: PhoneSequence, seconds: float, before=None, seed: int = 0):
    still = Trajectory(CHANNELS, np.zeros((round(seconds * FPS), 2), np.float32), FPS)
    pupils = Pupils.of_channels(CHANNELS)
    assert pupils is not None
    moved, after = pupils.apply(still, phones, seed, before)
    assert not moved.values[:, 0].any()
    return moved.values[:, 1], after


def test_pupils_fluctuate_slowly_by_a_tenth_of_their_diameter() -> None:
    weights, _ = dilated(PhoneSequence([SILENCE], [0.0, 120.0]), 120.0)
    assert 0.02 < DILATION * weights.std() < 0.08
    assert abs(weights).max() < 1
    assert np.abs(np.diff(weights)).max() * FPS < 1.0  # of the range in a second
    other, _ = dilated(PhoneSequence([SILENCE], [0.0, 120.0]), 120.0, seed=1)
    assert np.abs(weights - other).max() > 0.2


def test_speech_widens_them_within_seconds_whatever_the_pieces() -> None:
    silent, _ = dilated(PhoneSequence([SILENCE], [0.0, 6.0]), 6.0)
    speech = PhoneSequence([SILENCE, "ɑ", SILENCE], [0.0, 1.0, 5.0, 6.0])
    whole, _ = dilated(speech, 6.0)
    more = whole - silent
    assert np.abs(more[: int(FPS)]).max() < 1e-6
    assert 0.9 * SPEECH < more[int(4.9 * FPS)] < SPEECH
    assert more[-1] < 0.5 * SPEECH
    first, state = dilated(PhoneSequence([SILENCE, "ɑ"], [0.0, 1.0, 3.0]), 3.0)
    second, _ = dilated(PhoneSequence(["ɑ", SILENCE], [0.0, 2.0, 3.0]), 3.0, state)
    np.testing.assert_allclose(np.concatenate([first, second]), whole, atol=1e-5)


def test_a_face_without_the_shape_has_none() -> None:
    assert Pupils.of_channels(("jawOpen",)) is None
