"""The noise of a recording whose pauses are muted in part."""

import numpy as np
import pytest

from corpus_tools.recordings.limits import sound_measures
from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.types import Waveform

RATE = 16_000


@pytest.mark.parametrize("muted", [0.0, 5.0, 60.0])
def test_the_noise_is_that_of_the_room_however_much_is_muted(muted: float) -> None:
    random = np.random.default_rng(0)
    room, speech = (random.normal(0.0, level, RATE) for level in (0.01, 0.1))
    zeros = np.zeros(round(muted * RATE))
    sound = Waveform(np.concatenate([zeros, room, speech, room, zeros]).astype(np.float32), RATE)
    edges = [0.0, muted + 1.0, muted + 2.0, sound.duration]
    measured = sound_measures(sound, PhoneSequence([SILENCE, "ɑ", SILENCE], edges))
    assert measured["snr_db"] == pytest.approx(20.0, abs=1.0)


def test_silence_alone_is_no_noise() -> None:
    speech = np.random.default_rng(0).normal(0.0, 0.1, RATE)
    sound = Waveform(np.concatenate([np.zeros(RATE), speech]).astype(np.float32), RATE)
    measured = sound_measures(sound, PhoneSequence([SILENCE, "ɑ"], [0.0, 1.0, 2.0]))
    assert measured["snr_db"] > 60.0
