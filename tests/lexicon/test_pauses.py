"""Punctuation and lines that silence follows."""

import pytest

from lexicon.chunks import split_chunks
from lexicon.growing_text import GrowingText
from lexicon.marked_text import MarkedText
from lexicon.normalize import normalize
from lexicon.pauses import PARAGRAPH_S, PAUSES_S, last_mark, pause_behind
from lexicon.pronounce import pronounce
from lexicon.sentences import split_sentences
from lexicon.text_marks import parse_marks


@pytest.mark.parametrize(
    ("written", "mark"),
    [
        ("He left.", "."), ("He left", ""), ("“He left.”", "."), ("(really?)", "?"), ("Wait...", "…"), ("Wait…", "…"),
        ("And then —", "—"), ("Und dann –", "—"), ("one, ", ","), ("今日。", "."), ("¿Sí?", "?"),
        ("Так;»", ";"), ("", ""),
    ],
)  # fmt: skip
def test_the_last_mark_is_found_within_quotes(written: str, mark: str) -> None:
    assert last_mark(written) == mark


def test_pauses_are_those_of_the_table() -> None:
    assert pause_behind("Wait…") == PAUSES_S["…"] == 0.45
    assert pause_behind("He left") == PAUSES_S["."] == 0.5
    assert pause_behind("because the garden", is_cut=True) == PAUSES_S[","] == 0.25
    assert pause_behind("He left. \n \n") == PARAGRAPH_S == 0.8


@pytest.mark.parametrize("dash", [" – ", " — ", "—", " -- ", " - "])
def test_a_dash_is_a_mark_of_its_own(dash: str) -> None:
    assert [word.mark for word in pronounce(f"He came{dash}nobody knew why.").words] == ["", "—", "", "", "."]


def test_a_range_is_no_dash() -> None:
    assert normalize("pages 3–5") == "pages three to five"


@pytest.mark.parametrize("dots", ["…", "...", " ... ", "…… "])
def test_an_ellipsis_within_a_sentence_is_a_mark_of_its_own(dots: str) -> None:
    assert [word.mark for word in pronounce(f"He waited{dots}and left.").words] == ["", "…", "", "."]


@pytest.mark.parametrize(
    ("text", "sentences"),
    [
        ("Roses are red\nViolets are blue", ["Roses are red", "Violets are blue"]),
        ("Chapter One\nIt was a dark night.", ["Chapter One", "It was a dark night."]),
        ("Milk\n12 eggs\nFlour", ["Milk", "12 eggs", "Flour"]),
        ("I went to the\nmarket today.", ["I went to the market today."]),
        ("They told me and\nI believed it.", ["They told me and I believed it."]),
        ("We all went to the\nMuseum.", ["We all went to the Museum."]),
        ("The committee of the national museum decided last week\nThursday was free.",
         ["The committee of the national museum decided last week Thursday was free."]),
        ("Ich sah den Hund\nund die Katze.", ["Ich sah den Hund und die Katze."]),
        ("Dr.\nSmith came.", ["Dr. Smith came."]),
        ("1. Wash them\n2. Dry it in\n3. Go", ["1.", "Wash them", "2.", "Dry it in", "3.", "Go"]),
        ("- call them\n- a\n* b", ["- call them", "- a", "* b"]),
        ("Do this:\na) milk and\nb) eggs", ["Do this:", "a) milk and", "b) eggs"]),
        ("It was so\n– he said – that", ["It was so – he said – that"]),
    ],
)  # fmt: skip
def test_a_line_that_ends_on_purpose_is_a_sentence(text: str, sentences: list[str]) -> None:
    assert list(split_chunks(text, 300)) == sentences


def test_a_paragraph_pauses_longer_than_a_sentence() -> None:
    parts = split_sentences(MarkedText("One. Two.\n\nThree: four.\n \nFive"), "en-us")
    assert [part.pause_s for part in parts] == [0.5, PARAGRAPH_S, PARAGRAPH_S, None]


def test_stretches_of_ssml_are_paragraphs_and_sentences() -> None:
    text = parse_marks("<speak><p><s>One</s><s>Two</s></p><p>Three</p></speak>")
    assert [part.pause_s for part in split_sentences(text, "en-us")] == [0.5, PARAGRAPH_S, None]


def test_a_paragraph_is_known_while_text_arrives() -> None:
    growing = GrowingText("en-us")
    pieces = [piece for letter in "One.\n\nTwo. Three." for piece in growing.add(letter)]
    assert [pause_behind(piece) for piece in [*pieces, *growing.flush()]] == [PARAGRAPH_S, 0.5, 0.5]
