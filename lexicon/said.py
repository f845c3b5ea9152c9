"""A text in the words that a voice is given, in every language."""

from lexicon.foreign import with_letter_names
from lexicon.japanese import has_kanji, with_kana
from lexicon.normalize import normalize


def as_said(text: str, language: str) -> str:
    """English normalised; Japanese with Chinese characters in kana; single foreign letters by their names.

    Raises
    ------
    BackendError
        Japanese is to be read, and the library that does so is not installed.
    """
    if language.startswith("en"):
        return normalize(text)
    if language == "ja" and has_kanji(text):
        text = with_kana(text)
    return with_letter_names(text, language)
