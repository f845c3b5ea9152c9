"""The rate that is asked is the real one, whatever rates a voice has itself."""

from functools import cache

import numpy as np
import pytest

from tests.packages import needs
from tts2face.sound.delivery import speak_with
from tts2face.sound.prosody import Prosody
from tts2face.sound.shipped_voices import JOE_PACKAGE
from tts2face.sound.voice_pool import load_voice
from tts2face.types import Speech

TEXT = "Our noisy neighbour slowly carved five big maps, in the park."


RATES = {"heart": (0.7, 0.85, 1.1, 1.25, 1.34, 1.5, 2.0), "joe": (1.25, 2.0), "espeak": (0.7, 1.5)}


@cache
def spoken(name: str, rate: float) -> Speech:
    return speak_with(load_voice(name, "en-us"), TEXT, Prosody(rate), language="en-us")


@pytest.mark.parametrize(
    ("name", "rate"),
    [
        pytest.param(name, rate, marks=[pytest.mark.build] * (name == "joe"))
        for name, rates in RATES.items()
        for rate in rates
    ],
)
def test_words_last_as_long_as_the_rate_says(name: str, rate: float) -> None:
    if name == "joe":
        needs(JOE_PACKAGE)
    usual, changed = spoken(name, 1.0), spoken(name, rate)
    spans = [
        (float(speech.phones.edges[speech.words[0].first]), float(speech.phones.edges[speech.words[-1].last]))
        for speech in (usual, changed)
    ]
    (start, end), (first, last) = spans
    assert (end - start) / (last - first) == pytest.approx(rate, rel=0.03)  # 2 %, and the error of two edges
    assert [word.text for word in changed.words] == [word.text for word in usual.words]
    assert changed.phones.end == pytest.approx(changed.waveform.duration)
    assert np.abs(changed.waveform.samples).max() <= 1.0
