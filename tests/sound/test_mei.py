"""The Japanese voice of the extra: a real sound with the phones of the reading, and what chooses it."""

import numpy as np
import pytest

from lexicon.errors import InputError, SilentTextError
from tests.packages import needs
from tts2face.models.person import FEMALE, MALE, Person
from tts2face.sound.fitting import fitting_voice
from tts2face.sound.voice import SpokenWord, Voice
from tts2face.sound.voice_pool import default_voice, load_voice

TEXT = "今日は東京へ行きます。"


@pytest.fixture(scope="module")
def mei() -> Voice:
    needs("pyopenjtalk")
    return load_voice("mei", "ja")


def test_its_words_lie_at_its_sounds(mei: Voice) -> None:
    speech = mei.speak(TEXT)
    assert (mei.sample_rate, speech.waveform.rate) == (48_000, 48_000)
    assert len(speech.words) == 3
    edges = speech.phones.edges
    inside = speech.waveform.part(
        round(edges[speech.words[0].first] * 48_000), round(edges[speech.words[-1].last] * 48_000)
    )
    level, outside = (np.sqrt(np.mean(np.square(part.samples))) for part in (inside, speech.waveform.part(0, 2400)))
    assert 0.02 < level < 0.5
    assert outside < level / 20
    assert np.array_equal(mei.sound(TEXT).samples, speech.waveform.samples)


def test_its_rate_is_the_one_that_is_asked_for(mei: Voice) -> None:
    slow, fast = (mei.sound(TEXT, rate=rate).duration for rate in (0.8, 1.6))
    assert slow / fast == pytest.approx(2.0, rel=0.12)


def test_kana_and_words_are_spoken_and_signs_are_not(mei: Voice) -> None:
    assert mei.sound([SpokenWord("こんにちは", (), "。")]).duration > 0.5
    with pytest.raises(SilentTextError):
        mei.speak("。。。")
    with pytest.raises(InputError, match="speaks ja, not de"):
        load_voice("mei", "de")


def test_it_is_the_voice_of_japanese_where_it_is_installed() -> None:
    needs("pyopenjtalk")
    assert default_voice("ja") == "mei"
    assert fitting_voice(Person(FEMALE, 30), "ja").sentence == ""
    man = fitting_voice(Person(MALE, 30), "ja")
    assert (man.name, man.prosody.pitch) == ("mei", -9.1)
