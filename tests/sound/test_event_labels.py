"""Given phones in place of the variants that espeak-ng reports."""

import pytest

from lexicon.pronounce import pronounce
from lexicon.sequence import SILENCE
from tts2face.sound.espeak import given_starts, match_phones
from tts2face.sound.voice_pool import load_voice


def test_phones_are_matched_one_by_one_where_they_can_be() -> None:
    assert match_phones(("b", "ʌ", "t", "ɚ"), ("b", "ʌ", "ɾ", "ɚ")) == ((0, 0), (1, 1), (2, 2), (3, 3))


def test_split_and_joined_phones() -> None:
    assert given_starts(("b", "ɝ", "d"), ("b", "ɜ", "ɹ", "d"), [0.0, 0.1, 0.2, 0.3], 0.4) == [0.0, 0.1, 0.3]
    assert given_starts(("ə", "l"), ("l",), [0.2], 0.4) == pytest.approx([0.2, 0.3])


def test_a_phone_without_duration_takes_half_of_the_one_before_it() -> None:
    assert given_starts(("ɑ", "l"), ("ɑ", "l"), [0.0, 0.3], 0.3) == pytest.approx([0.0, 0.15])


@pytest.mark.parametrize(
    "text",
    [
        "She better put the butter in the bottle.",
        "You are never sure about the fire, the tour or the beer.",
        "He wants her to hear the music of the world; I read a lead pipe.",
        "Little by little the children saw an owl and a wolf.",
    ],
)
def test_espeak_speaks_the_printed_phones_of_american_english(text: str) -> None:
    speech = load_voice("espeak", "en-us").speak(text)
    assert [phone for phone in speech.phones.phones if phone != SILENCE] == list(pronounce(text).phones)
    assert [word.text for word in speech.words] == [word.text for word in pronounce(text).words]
