"""Sentences of each language with a table, written down with their reading before anything was run.

Several readings that are all right stand between ``|``. Vowel signs of Arabic do not count, nor do spaces within words
of numbers where a language is written without them or has them at will.
"""

import unicodedata
from pathlib import Path
from typing import Any

import pytest

from lexicon.normalize import spoken_form
from lexicon.vowels import without_vowels

TABLES = sorted(Path(__file__).parent.glob("*.tsv"))
UNSPACED = frozenset({"cmn", "ja", "ko"})


def _rows() -> list[Any]:
    found = []
    for path in TABLES:
        for line in path.read_text(encoding="utf-8").splitlines()[1:]:
            _, text, spoken, guide = line.split("\t")
            assert guide
            marks = [pytest.mark.needs("pyopenjtalk")] if path.stem == "ja" else []  # reads Chinese characters
            found.append(pytest.param(path.stem, text, spoken, marks=marks))
    return found


def _key(text: str, language: str) -> str:
    plain = without_vowels(unicodedata.normalize("NFC", text), language).casefold()
    kept = (sign if sign.isalnum() or unicodedata.category(sign)[0] == "M" or sign in "'’" else " " for sign in plain)
    return ("" if language in UNSPACED else " ").join("".join(kept).split())


@pytest.mark.parametrize(("language", "text", "spoken"), _rows())
def test_a_sentence_is_read_as_its_grammar_says(language: str, text: str, spoken: str) -> None:
    said = spoken_form(text, language)
    assert _key(said, language) in {_key(own, language) for own in spoken.split("|")}
    assert spoken_form(said, language) == said
