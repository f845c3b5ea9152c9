"""Every installed voice speaks hundreds of short sentences, whatever their words, marks and rate."""

import itertools

import numpy as np
import pytest

from lexicon.sequence import SILENCE
from tests.packages import needs
from tts2face.sound.delivery import speak_with
from tts2face.sound.prosody import Prosody
from tts2face.sound.shipped_voices import JOE_PACKAGE
from tts2face.sound.voice_pool import load_voice

SUBJECTS = ("He", "She", "Bob", "It", "We", "Nobody", "Anna", "That", "Tom")
VERBS = ("left", "ate", "came", "stopped", "agreed", "tried", "saw it", "owes me", "is up", "went", "laughed", "asked")
ENDS = (".", "?", "!", " already?", " at eight.", " too soon!", "...", ", yes.")
OTHERS = ("No.", "Oh!", "Yes?", "I?", "A.", "Hmm.", "OK.", "5.", "Ah, so.", "Mm.")
RATES = (1.0, 1.25, 0.8)


@pytest.mark.parametrize("n", [60, pytest.param(500, marks=pytest.mark.nightly)])
@pytest.mark.parametrize("name", ["heart", "joe", "espeak", "espeak-female"])
def test_short_sentences_are_spoken(name: str, n: int) -> None:
    if name == "joe":
        needs(JOE_PACKAGE)
    voice = load_voice(name, "en-us")
    made = [f"{subject} {verb}{end}" for end, verb, subject in itertools.product(ENDS, VERBS, SUBJECTS)]
    texts = [*OTHERS, *made[:: len(made) * 10 // (n * 11)]]
    assert len(texts) >= n
    for text, rate in zip(texts, itertools.cycle(RATES), strict=False):
        speech = speak_with(voice, text, Prosody(rate), language="en-us")
        edges = speech.phones.edges
        assert edges[0] == 0.0, text
        assert edges[-1] == pytest.approx(speech.waveform.duration), text
        assert np.diff(edges).min() > 0.0, text
        assert any(phone != SILENCE for phone in speech.phones.phones), text
