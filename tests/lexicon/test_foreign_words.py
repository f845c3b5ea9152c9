"""Words that the language of a text does not read: by the language of their writing system, or by their letters."""

import sys
import unicodedata

import pytest

from lexicon import foreign_words
from lexicon.foreign_words import letter_names, make_readable
from lexicon.g2p import languages
from lexicon.marked_text import GestureMark, PauseMark
from lexicon.scripts import check_readable
from lexicon.text_language import LANGUAGE_OF_SCRIPT
from lexicon.text_marks import parse_marks


def runs_of(text: str, language: str = "en-us") -> list[tuple[str, str | None]]:
    """Parts of a text with their languages."""
    readable, _ = make_readable(parse_marks(text, language), language)
    ends = [*(run.start for run in readable.runs[1:]), len(readable.text)]
    return [(readable.text[run.start : end], run.language) for run, end in zip(readable.runs, ends, strict=True)]


@pytest.mark.parametrize(
    ("text", "language", "runs"),
    [
        ("The word 你好 means hello.", "en-us", [("The word ", None), ("你好", "cmn"), (" means hello.", None)]),
        ("Say Я и ты.", "en-us", [("Say ", None), ("Я и ты", "ru"), (".", None)]),
        ("Слава Україні, he said", "en-us", [("Слава Україні", "uk"), (", he said", None)]),
        ("Angles α, β and γ, 5 kΩ, Ж", "en-us", [("Angles α, β and γ, 5 kΩ, Ж", None)]),
        ("第3章 is chapter 3", "en-us", [("第3章", "cmn"), (" is chapter 3", None)]),
        ("한국어世界", "de", [("한국어", "ko"), ("世界", "cmn"), ("", None)]),
        ("日本 한국", "ko", [("日本", "cmn"), (" 한국", None)]),
        ("<speak>A <lang xml:lang='ru'>мир 你好</lang></speak>", "en-us",
         [("A ", None), ("мир ", "ru"), ("你好", "cmn"), ("", None)]),
        ("Plain text, naïve café.", "en-us", [("Plain text, naïve café.", None)]),
    ],
)  # fmt: skip
def test_words_of_other_writing_systems_are_runs_of_their_language(
    text: str, language: str, runs: list[tuple[str, str | None]]
) -> None:
    found = [run for run in runs_of(text, language) if run[0]]
    assert found == [run for run in runs if run[0]]


def test_letters_that_no_language_reads_are_named_and_marks_stay_where_they_are() -> None:
    written = parse_marks("A ខ្មែរ [nod]word [pause 0.5]ខម end [style:calm]now[/style].")
    readable, notes = make_readable(written, "en-us")
    assert readable.text == "A kha mo ro word kha mo end now."
    assert notes == ("Khmer words are spelled",)
    nod, pause = readable.marks
    assert (nod, pause) == (GestureMark(12), PauseMark(17, 0.5))
    assert [(run.start, run.styles) for run in readable.runs] == [(0, ()), (28, ("calm",)), (31, ())]


def test_letters_without_names_are_signs() -> None:
    assert letter_names("𓀀𓀁") == "egyptian sign"


def test_every_letter_of_unicode_is_readable() -> None:
    """Whatever is a letter is spoken in some way, in every writing system, in five languages."""
    letters = [chr(code) for code in range(0x370, sys.maxunicode + 1) if unicodedata.category(chr(code))[0] == "L"]
    by_script: dict[str, list[str]] = {}
    for letter in letters:
        by_script.setdefault(unicodedata.name(letter, "").partition(" ")[0], []).append(letter)
    texts = [f"a {one[0]}{one[-1]} b {one[len(one) // 2] * 3} c" for one in by_script.values()]
    assert len(texts) > 150
    for language in ("en-us", "de", "ru", "cmn", "ko"):
        for text in texts:
            readable, _ = make_readable(parse_marks(text, language), language)
            check_readable(readable, language)


def test_all_languages_of_scripts_are_spoken() -> None:
    assert set(LANGUAGE_OF_SCRIPT.values()) <= set(languages())


def test_japanese_without_its_reader_is_spoken_by_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(foreign_words, "has_reader", lambda: False)
    assert runs_of("Say 日本の.") == [("Say ", None), ("日本", "cmn"), ("の", "ja"), (".", None)]
    assert runs_of("A 곢\u1accノ b") == [("A ", None), ("곢\u1acc", "ko"), ("ノ", "ja"), (" b", None)]


def test_signs_that_stand_for_letters_are_these_letters() -> None:
    assert runs_of("A 겢㈉ b ㌔.") == [("A ", None), ("겢(ᄎ)", "ko"), (" b ", None), ("キロ", "ja"), (".", None)]
    assert runs_of("A 곢\u1accノ b") == [("A ", None), ("곢\u1acc", "ko"), ("ノ", "ja"), (" b", None)]
