"""Spoken form of a text, the input of a voice, in every language."""

import re

from lexicon.foreign_letters import name_foreign_letters
from lexicon.german_dates import read_german_dates
from lexicon.japanese import has_kanji, to_kana
from lexicon.normalize import normalize
from lexicon.number_words import MAX_CARDINAL_DIGITS

# espeak-ng omits what follows the first 160 letters of a word; the longest in use have 85. From U+0900 on, scripts
# without spaces between words begin.
_LONG_WORD = re.compile(r"[^\W\d_\u0900-\U0010ffff]{100}(?=[^\W\d_\u0900-\U0010ffff])")
_LONG_NUMBER = re.compile(rf"[0-9]{{{MAX_CARDINAL_DIGITS + 1},}}")


def spoken_form(text: str, language: str) -> str:
    """Spoken form of a text.

    English is normalised, days of German dates are written as words, Japanese with Chinese characters is converted to
    kana, and single letters of other writing systems are replaced by their names. A word of more than 100 letters is
    divided, and the digits of a longer number than English names are separated.

    Raises
    ------
    BackendError
        The text is Japanese with Chinese characters, and the library that reads them is not installed.
    """
    if language.startswith("en"):
        return _LONG_WORD.sub(r"\g<0> ", normalize(text))
    if language == "ja" and has_kanji(text):
        text = to_kana(text)
    if language.partition("-")[0] == "de":
        text = read_german_dates(text)
    text = _LONG_NUMBER.sub(lambda number: " ".join(number.group()), name_foreign_letters(text, language))
    return _LONG_WORD.sub(r"\g<0> ", text)
