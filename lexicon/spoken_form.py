"""Spoken form of a text, the input of a voice, in every language."""

from lexicon.foreign_letters import name_foreign_letters
from lexicon.german_dates import read_german_dates
from lexicon.japanese import has_kanji, to_kana
from lexicon.normalize import normalize


def spoken_form(text: str, language: str) -> str:
    """Spoken form of a text.

    English is normalised, days of German dates are written as words, Japanese with Chinese characters is converted to
    kana, and single letters of other writing systems are replaced by their names.

    Raises
    ------
    BackendError
        The text is Japanese with Chinese characters, and the library that reads them is not installed.
    """
    if language.startswith("en"):
        return normalize(text)
    if language == "ja" and has_kanji(text):
        text = to_kana(text)
    if language.partition("-")[0] == "de":
        text = read_german_dates(text)
    return name_foreign_letters(text, language)
