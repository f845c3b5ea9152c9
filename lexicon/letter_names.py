"""Names of single letters of writing systems that the language of a text does not use (π, Ж, א)."""

import functools
import re
import unicodedata
from types import MappingProxyType

from lexicon import written_forms as readings

_UNICODE_NAME = re.compile(r"(?:LETTER|CHARACTER|SYLLABLE) (?:(?:FINAL|SMALL) )?(.+?)(?: WITH .*)?")
_PREFIX = re.compile(r"^.*?\b(?=(?:LETTER|CHARACTER|SYLLABLE) )")
_VOWELS = MappingProxyType({"a": "ah", "e": "eh", "i": "ee", "o": "oh", "u": "oo"})  # Unicode's names of vowels


@functools.lru_cache(maxsize=2000)
def letter_name(letter: str) -> str:
    """Name of a letter from the table of symbols, else from its Unicode name; empty if it has none.

    Chinese characters have none, as each is a word.
    """
    known = readings.read_table("symbols.tsv").get(letter)
    if known:
        return known[0]
    base = unicodedata.normalize("NFD", letter)[:1]
    if base != letter and unicodedata.name(letter, "").startswith("GREEK"):
        return letter_name(base)
    match = _UNICODE_NAME.fullmatch(_PREFIX.sub("", unicodedata.name(letter, ""), count=1))
    name = "" if match is None else match[1].lower().replace(" ", "-")
    return _VOWELS.get(name, name) if name.replace("-", "").isalpha() else ""


def run_name(run: str) -> str:
    """Name of a run that is a single letter; empty for words."""
    letter = unicodedata.normalize("NFKC", run)
    return letter_name(letter) if len(letter) == 1 else ""
