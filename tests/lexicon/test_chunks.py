"""A long text in pieces."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lexicon.chunks import chunks
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
    assert list(chunks(text, 300)) == pieces


def test_long_sentences_are_cut_at_clauses_then_at_spaces() -> None:
    assert list(chunks("one two, three four five", 12)) == ["one two,", "three four", "five"]
    assert list(chunks("incomprehensibilities are long", 10)) == ["incomprehensibilities", "are long"]
    assert list(chunks("漢字" * 10, 8)) == ["漢字" * 4, "漢字" * 4, "漢字" * 2]


def test_limit_below_one_is_refused() -> None:
    with pytest.raises(InputError, match="at least 1 character, not 0"):
        list(chunks("x", 0))


@given(st.text(), st.integers(1, 50))
def test_nothing_but_space_is_lost(text: str, limit: int) -> None:
    assert "".join("".join(chunks(text, limit)).split()) == "".join(text.split())


def test_a_megabyte_comes_in_bounded_pieces() -> None:
    pieces = list(chunks("The quick brown fox jumps over the lazy dog, and again. " * 18_000, 300))
    assert len(pieces) == 18_000
    assert max(map(len, pieces)) < 60
