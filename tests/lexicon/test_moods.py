"""Moods of sentences from their words."""

import time
from collections import Counter

import pytest

from lexicon.marked_text import MarkedText, StyleRun
from lexicon.moods import MOODS, mood_rows, sentence_mood, with_moods
from lexicon.ssml_leniency import nearest_style
from lexicon.text_marks import parse_marks
from tests.bench.bench_moods import read_sentences
from tts2face.source_options import is_auto


@pytest.mark.parametrize(("use", "least"), [("given", 48), ("kept", 43)])
def test_most_moods_are_those_that_people_read(use: str, least: int) -> None:
    rows = [row for row in read_sentences() if row["use"] == use]
    found = [(row["mood"], sentence_mood(row["text"]).name or "neutral") for row in rows]
    assert len(found) == 51
    assert sum(mood == taken for mood, taken in found) >= least
    # doubt is neutral: no mood is taken for its opposite
    assert not {("happy", "sad"), ("sad", "happy"), ("happy", "angry"), ("angry", "happy")} & set(Counter(found))


@pytest.mark.parametrize(
    ("sentence", "mood"),
    [
        ("I am happy.", "happy"),
        ("I am not happy.", None),
        ("I'm really not happy about it.", "sad"),
        ("I'm not sad.", None),
        ("I’m not sad.", None),
        ("Are you happy?", None),
        ("If you are happy, clap your hands.", None),
        ("The film was sad, but we had fun.", "happy"),
        ("We had fun, but he died.", "sad"),
        ("The Happy Prince is a story.", None),
        ("He is slightly angry.", None),
        ("I CAN'T BELIEVE IT!", "surprised"),
        ("Don’t you dare!", "angry"),
        ("", None),
        ("12 + 4", None),
    ],
)
def test_what_stands_about_a_word_decides(sentence: str, mood: str | None) -> None:
    assert sentence_mood(sentence).name == mood


def test_the_words_that_decide_are_told() -> None:
    found = sentence_mood("I'm so sorry, he died last night.")
    assert (found.name, found.style) == ("sad", "depressed")
    assert found.reason == "so sorry (2), died (3)"


def test_rows_of_the_table_are_moods_and_words_stand_once() -> None:
    rows = [*mood_rows()]
    assert {mood for mood, _, _ in rows} == {*MOODS, "none"}
    assert all(nearest_style(style) for style in MOODS.values())
    words = [(mood, word) for mood, _, words in rows for word in words]
    assert [pair for pair, n in Counter(words).items() if n > 1] == []
    assert [word for _, word in words if word != word.casefold() or word != " ".join(word.split())] == []


def test_sentences_without_a_style_get_that_of_their_mood() -> None:
    text = "We won the cup! [style:annoyed]I am so sad.[/style] The door is open. He died."
    made, notes = with_moods(parse_marks(text), "en-us")
    assert [run.styles for run in made.runs] == [("delighted",), (), ("annoyed",), (), ("depressed",)]
    assert [made.text[run.start :].split()[0] for run in made.runs] == ["We", "I", "I", "The", "He"][:5]
    assert notes[0] == "'We won the cup!' is delighted, by We won (2.5)"
    assert with_moods(MarkedText("The door is open."), "en-gb") == (MarkedText("The door is open."), ())


def test_other_languages_are_neutral_with_a_note() -> None:
    text = MarkedText("Wir haben gewonnen!", (StyleRun(0),))
    assert with_moods(text, "de") == (
        text, ("--style auto reads English words, not those of de: all sentences are neutral",)
    )  # fmt: skip


def test_a_style_is_auto_or_has_a_name() -> None:
    assert [is_auto(style) for style in (None, "auto", " auto ", "automatic")] == [False, True, True, False]


@pytest.mark.parametrize("piece", ["happy ", "not ", "I am so sorry, ", "but ", "won! ", "if, "])
def test_long_texts_are_read_at_once(piece: str) -> None:
    begin = time.perf_counter()
    with_moods(MarkedText(piece * (100_000 // len(piece))), "en-us")
    assert time.perf_counter() - begin < 10


def test_notes_are_limited() -> None:
    _, notes = with_moods(MarkedText("We won the cup! " * 50), "en-us")
    assert (len(notes), notes[-1]) == (21, "30 further sentences have the style of their mood")
