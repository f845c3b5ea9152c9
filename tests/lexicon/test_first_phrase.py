"""A long first sentence is divided after its first phrase, so that a clip begins soon."""

import pytest

from lexicon.chunks import split_phrase
from lexicon.pauses import PAUSES_S
from lexicon.sentence_length import FIRST_PIECE_CHARACTERS
from lexicon.sentences import split_sentences
from lexicon.text_marks import parse_marks

HOUSE = "the garden behind the old house near the river had been green for years"


@pytest.mark.parametrize(
    ("sentence", "first"),
    [
        (f"When we had come home, late in the evening, {HOUSE}.", "When we had come home, late in the evening,"),
        (f"We came home and nobody knew that {HOUSE}.", "We came home and nobody knew"),
        (f"Most small gardens like this one near rivers {HOUSE}.", "Most small gardens like this one"),
        (f"Most small gardens have more trees than this {HOUSE}.", "Most small gardens have more trees than this the"),
        (f"Nearly all large gardens in 5 or 10 towns {HOUSE}.", "Nearly all large gardens in 5 or 10 towns the"),
        (f"We came home on Sunday, May 5, 2024 and {HOUSE}.", "We came home on Sunday,"),
        ("漢字" * 60, "漢字" * 60),
        ("We came home.", "We came home."),
    ],
)
def test_a_phrase_ends_at_the_best_place(sentence: str, first: str) -> None:
    assert split_phrase(sentence, 50) == (first, sentence[len(first) :].strip())


def test_both_parts_of_a_sentence_are_phrases_of_their_own() -> None:
    """Neither is a single word, even where the last clause mark lies near the end."""
    sentence = "There was a garden behind the old house near the river, he said."
    first, rest = split_phrase(sentence, 60)
    assert len(rest) >= 20
    assert f"{first} {rest}" == sentence


def test_the_first_sentence_only_is_divided() -> None:
    long = f"We came home and nobody knew that it was late in the evening because {HOUSE}."
    parts = list(split_sentences(parse_marks(f"{long} {long}"), "en-us"))
    assert [part.pause_s for part in parts] == [PAUSES_S[","], PAUSES_S["."], None]
    assert " ".join(part.utterances[0].source for part in parts) == f"{long} {long}"
    assert len(parts[0].utterances[0].source) <= FIRST_PIECE_CHARACTERS
    assert parts[0].utterances[0].text.endswith(",")  # so that the voice does not end a sentence there
    assert [part.first for part in parts[1:]] == [part.last for part in parts[:-1]]


def test_a_first_sentence_within_the_limit_stays_whole() -> None:
    (only,) = split_sentences(parse_marks("x" * (FIRST_PIECE_CHARACTERS - 1) + "."), "en-us")
    assert only.pause_s is None
