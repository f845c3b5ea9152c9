"""Transcripts of long recordings, with a recogniser that hears a vowel in whatever it gets."""

from types import SimpleNamespace

import pytest

from tests.sound.test_pauses import in_silence, speech_with_pauses
from tts2face.sound import transcript
from tts2face.types import Waveform

WORDS = (("me", (("m", "i"),)),)


class HearsVowels:
    """Stands for the aligner."""

    def hear(self, part: Waveform) -> SimpleNamespace:
        return SimpleNamespace(words=lambda: [["ʌ"]])


@pytest.mark.parametrize("noise", [0.0, 1e-5])
def test_no_word_is_looked_for_in_silence(noise: float, monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[list[str]] = []

    def stop(_: object, recognised: list[list[str]]) -> None:
        seen.extend(recognised)
        raise StopIteration

    monkeypatch.setattr(transcript, "Aligner", HearsVowels)
    monkeypatch.setattr(transcript, "assign_words", stop)
    sound = in_silence(speech_with_pauses(1.0, 0.5, 1.0), 45.0, noise)
    with pytest.raises(StopIteration):
        transcript.align_recording(sound, WORDS)
    assert seen.count(["ʌ"]) == 1
    assert seen.count([]) == len(seen) - 1 >= 4


def test_nothing_is_recognised_in_silence(monkeypatch: pytest.MonkeyPatch) -> None:
    heard: list[float] = []

    def align(_: object, part: Waveform, words: None) -> object:
        heard.append(part.duration)
        return transcript.unwritten_part(part, 1)

    monkeypatch.setattr(HearsVowels, "align", align, raising=False)
    monkeypatch.setattr(transcript, "Aligner", HearsVowels)
    sound = in_silence(speech_with_pauses(1.0, 0.5, 1.0), 45.0)
    assert transcript.recognise_phones(sound).end == pytest.approx(sound.duration, abs=0.01)
    assert heard == [pytest.approx(20.0, abs=10.0)]
