"""Forms of function words that the next sound allows."""

import pytest

from lexicon.function_words import fitting_forms
from tts2face.sound.transcript import pronounce_transcript

SCHWA, FULL = ("ð", "ə"), ("ð", "i")
VOWEL, CONSONANT = ("apple", (("æ", "p", "ə", "l"),)), ("cat", (("k", "æ", "t"),))
EITHER = ("herb", (("ɝ", "b"), ("h", "ɝ", "b")))


@pytest.mark.parametrize(
    ("following", "forms"),
    [(VOWEL, (SCHWA, FULL)), (CONSONANT, (SCHWA,)), (EITHER, (SCHWA, FULL)), (None, (SCHWA, FULL))],
)
def test_the_has_the_forms_that_the_next_sound_allows(following, forms):
    words = [("The", (SCHWA, FULL)), *([following] if following else [])]
    assert fitting_forms(words) == (("The", forms), *words[1:])


def test_to_is_rounded_before_vowels():
    to = ("to", (("t", "ə"), ("t", "u"), ("t", "ɪ")))
    assert fitting_forms([to, VOWEL])[0] == ("to", (("t", "u"),))
    assert fitting_forms([to, CONSONANT])[0] == to


def test_the_last_form_and_other_words_stay():
    assert fitting_forms([("the", (FULL,)), CONSONANT])[0] == ("the", (FULL,))
    assert fitting_forms([("we", (("w", "i"),)), CONSONANT])[0] == ("we", (("w", "i"),))
    assert fitting_forms([]) == ()


def test_transcripts_have_them():
    words = pronounce_transcript("The cat and the apple.", "en-us")
    assert words[0][1] == (SCHWA, ("ð", "ʌ"))
    assert FULL in words[3][1]
