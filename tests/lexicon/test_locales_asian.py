"""Written forms in Arabic, Hindi, Mandarin, Japanese, Korean and Vietnamese: forty lines each, as a person reads them.

The readings were written before the tables, after these grammars and guides:

- ar: Ryding, A Reference Grammar of Modern Standard Arabic (2005), chapter 15; without the endings of pause
- hi: McGregor, Outline of Hindi Grammar (1995), numerals and dates; spelling of the Central Hindi Directorate
- cmn: GB/T 15835-2011, numerals in publications; 吕叔湘, 现代汉语八百词 (二 and 两)
- ja: NHK, 日本語発音アクセント新辞典 (2016), appendix of counters; 公用文作成の考え方 (2022)
- ko: 한글 맞춤법 (2017), §§ 43, 44 and 52; native numbers with counters after 국립국어원, 표준국어문법론
- vi: Nguyễn Đình-Hoà, Vietnamese (1997), numerals; Thông tư 01/2011/TT-BNV for abbreviations
"""

import re
import unicodedata
from importlib import resources

import pytest

from lexicon.normalize import spoken_form
from lexicon.vowels import without_vowels

LANGUAGES = ("ar", "hi", "cmn", "ja", "ko", "vi")
UNSPACED = frozenset({"cmn", "ja", "ko"})  # in which spaces between words of numbers are free


def _rows() -> list[tuple[str, str, str]]:
    folder = resources.files("tests.lexicon").joinpath("locales")
    found = []
    for language in LANGUAGES:
        lines = folder.joinpath(f"{language}.tsv").read_text(encoding="utf-8").splitlines()[1:]
        assert len(lines) == 40
        found += [(language, *line.split("\t")[1:3]) for line in lines]
    return found


def _key(text: str, language: str) -> str:
    """A text without marks, capitals, vowels of Arabic, and in some languages spaces."""
    plain = without_vowels(unicodedata.normalize("NFC", text), language).casefold()
    kept = (letter if letter.isalnum() or unicodedata.category(letter)[0] == "M" else " " for letter in plain)
    words = "".join(kept).split()
    return ("" if language in UNSPACED else " ").join(words)


@pytest.mark.parametrize(("language", "text", "right"), _rows())
def test_written_forms_are_said_as_a_person_says_them(language: str, text: str, right: str) -> None:
    assert _key(spoken_form(text, language), language) in {_key(own, language) for own in right.split("|")}


@pytest.mark.parametrize("language", LANGUAGES)
def test_words_of_a_spoken_form_are_spoken_as_they_are(language: str) -> None:
    for row in _rows():
        if row[0] == language:
            spoken = spoken_form(row[1], language)
            assert not re.search(r"[0-9%$€¥₹₩]", spoken)
            assert spoken_form(spoken, language) == spoken
