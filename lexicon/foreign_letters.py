"""Names of single letters of other writing systems in place of the letters (The value of π, ΔT, the letter Ж)."""

import re
from collections.abc import Iterator

from lexicon import written_forms as readings
from lexicon.letter_names import run_name
from lexicon.scripts import foreign_runs, letter_script

# Scripts whose letters espeak-ng names in every language; for others it speaks a code, as in "Thai letter E 0 1".
NAMED_BY_ESPEAK = frozenset({
    "GREEK", "CYRILLIC", "HEBREW", "ARABIC", "GEORGIAN", "ARMENIAN", "HANGUL", "DEVANAGARI", "BENGALI", "GUJARATI",
    "GURMUKHI", "KANNADA", "MALAYALAM", "TAMIL", "TELUGU", "SINHALA",
})  # fmt: skip
_WORD = re.compile(r"[^\W\d_]+")


def name_foreign_letters(text: str, language: str) -> str:
    """The text with each single foreign letter that espeak-ng cannot name replaced by its name.

    Foreign words are kept; in Japanese, where espeak-ng reads no Latin letters as words, so are letters.
    """
    if text.isascii() or language.partition("-")[0] == "ja":
        return text
    return "".join(_pieces(text, language, NAMED_BY_ESPEAK))


def name_letters_in_words(text: str) -> str:
    """English text with the names of single foreign letters that stand within a word (ΔT), except in units (kΩ)."""
    return text if text.isascii() else _WORD.sub(_name_letters, text)


def _name_letters(match: "re.Match[str]") -> str:
    word = match.group()
    if len(word) == 1 or word.isascii() or word in readings.read_table("units.tsv"):
        return word
    return "".join(_pieces(word, "en", frozenset()))


def _pieces(text: str, language: str, kept: frozenset[str]) -> Iterator[str]:
    at = 0
    for start, end in foreign_runs(text, language):
        name = "" if letter_script(text[start]) in kept else run_name(text[start:end])
        if name:
            yield text[at:start]
            yield " " * text[start - 1 : start].isalnum() + name + " " * text[end : end + 1].isalnum()
            at = end
    yield text[at:]
