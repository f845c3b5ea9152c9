"""A microphone, for which a file stands: its samples, and what is refused."""

import sys
import wave
from pathlib import Path

import numpy as np
import pytest

from lexicon.errors import BackendError
from tts2face.sound import microphone
from tts2face.sound.microphone import open_microphone


def test_samples_of_both_channels_become_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "said.wav"
    left, right = (np.full(4410, level, "<i2") for level in (8192, 16384))
    with wave.open(str(path), "wb") as file:
        file.setnchannels(2)
        file.setsampwidth(2)
        file.setframerate(44_100)
        file.writeframes(np.stack([left, right], axis=1).tobytes())
    monkeypatch.setitem(microphone.DEVICES, sys.platform, ("wav", str(path)))
    with open_microphone() as (rate, blocks):
        samples = np.concatenate(list(blocks))
    assert (rate, len(samples)) == (44_100, 4410)
    assert samples == pytest.approx(0.375, abs=1e-3)


def test_a_device_that_is_not_there_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(microphone.DEVICES, sys.platform, ("wav", "default"))
    refusal = r"the microphone 'no-such' cannot be opened \(.+\); name another one"
    with pytest.raises(BackendError, match=refusal), open_microphone("no-such"):
        pass


def test_windows_needs_the_name_of_a_device(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "platform", "win32")
    with pytest.raises(BackendError, match="Windows has no usual microphone here; name one"), open_microphone():
        pass
