"""A long text in pieces."""

import time
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lexicon.chunks import split_chunks
from lexicon.errors import InputError


@pytest.mark.parametrize(
    ("text", "pieces"),
    [
        ("One. Two! Three?", ["One.", "Two!", "Three?"]),
        ('He said "No." Then he left.', ['He said "No."', "Then he left."]),
        ("Dr. Smith met J. K. Rowling. They talked.", ["Dr. Smith met J. K. Rowling.", "They talked."]),
        ("It cost 3.50 dollars. cheap", ["It cost 3.50 dollars. cheap"]),
        ("A title\n\nA paragraph\nof two lines", ["A title", "A paragraph of two lines"]),
        ("今日は。元気ですか？", ["今日は。", "元気ですか？"]),
        ("", []),
        (" \n ", []),
    ],
)
def test_sentences(text: str, pieces: list[str]) -> None:
    assert list(split_chunks(text, 300)) == pieces


def test_long_sentences_are_cut_at_clauses_then_at_spaces() -> None:
    assert list(split_chunks("one two, three four five", 12)) == ["one two,", "three four", "five"]
    assert list(split_chunks("incomprehensibilities are long", 10)) == ["incomprehensibilities", "are long"]
    assert list(split_chunks("漢字" * 10, 8)) == ["漢字" * 4, "漢字" * 4, "漢字" * 2]


def test_limit_below_one_is_refused() -> None:
    with pytest.raises(InputError, match="at least 1 character, not 0"):
        list(split_chunks("x", 0))


@given(st.text(), st.integers(1, 50))
def test_nothing_but_space_is_lost(text: str, limit: int) -> None:
    assert "".join("".join(split_chunks(text, limit)).split()) == "".join(text.split())


def test_a_megabyte_is_divided_into_bounded_pieces() -> None:
    pieces = list(split_chunks("The quick brown fox jumps over the lazy dog, and again. " * 18_000, 300))
    assert len(pieces) == 18_000
    assert max(map(len, pieces)) < 60


def sentence_ends() -> list[tuple[str, list[str]]]:
    rows = Path(__file__).with_name("sentence_ends.tsv").read_text(encoding="utf-8").splitlines()[1:]
    return [(language, written.split("|")) for language, written in (row.split("\t") for row in rows)]


@pytest.mark.parametrize(("language", "expected"), sentence_ends())
def test_abbreviations_end_no_sentence_and_sentence_ends_do(language: str, expected: list[str]) -> None:
    assert list(split_chunks(" ".join(expected), 300, language)) == expected


def test_the_list_of_sentence_ends_holds_both_kinds() -> None:
    english = [pieces for language, pieces in sentence_ends() if language == "en-us"]
    assert len(english) >= 60
    assert sum(len(pieces) > 1 for pieces in english) >= 25
    assert sum(len(pieces) == 1 and "." in pieces[0][:-2] for pieces in english) >= 25


@pytest.mark.parametrize("text", ["etc. " * 50_000, "A. " * 80_000, "x" * 200_000 + ". A", "5. " * 80_000])
def test_a_row_of_abbreviations_is_cut_at_once(text: str) -> None:
    begin = time.perf_counter()
    assert sum(1 for _ in split_chunks(text, 300, "de")) > 0
    assert time.perf_counter() - begin < 5
