"""Texts with the names of single letters that their language does not read (The value of π, ΔT, the letter Ж)."""

import re
from collections.abc import Iterator

from lexicon import written_forms as readings
from lexicon.letters import run_name
from lexicon.writing_systems import foreign_runs, letter_script

# Scripts whose letters espeak-ng names in every language; of others it says a code, as in "Thai letter E 0 1".
NAMED_BY_ESPEAK = frozenset({
    "GREEK", "CYRILLIC", "HEBREW", "ARABIC", "GEORGIAN", "ARMENIAN", "HANGUL", "DEVANAGARI", "BENGALI", "GUJARATI",
    "GURMUKHI", "KANNADA", "MALAYALAM", "TAMIL", "TELUGU", "SINHALA",
})  # fmt: skip
_WORD = re.compile(r"[^\W\d_]+")


def with_letter_names(text: str, language: str) -> str:
    """The text with each single foreign letter that espeak-ng cannot name replaced by its name; foreign words stay.

    In Japanese espeak-ng reads no Latin letters as words: letters stay, too.
    """
    if text.isascii() or language.partition("-")[0] == "ja":
        return text
    return "".join(_pieces(text, language, NAMED_BY_ESPEAK))


def with_names_inside(text: str) -> str:
    """English text with the names of single foreign letters that stand within a word (ΔT), except in units (kΩ)."""
    return text if text.isascii() else _WORD.sub(_named_inside, text)


def _named_inside(match: "re.Match[str]") -> str:
    word = match.group()
    if len(word) == 1 or word.isascii() or word in readings.read_table("units.tsv"):
        return word
    return "".join(_pieces(word, "en", frozenset()))


def _pieces(text: str, language: str, kept: frozenset[str]) -> Iterator[str]:
    behind = 0
    for begin, end in foreign_runs(text, language):
        name = "" if letter_script(text[begin]) in kept else run_name(text[begin:end])
        if name:
            yield text[behind:begin]
            yield " " * text[begin - 1 : begin].isalnum() + name + " " * text[end : end + 1].isalnum()
            behind = end
    yield text[behind:]
