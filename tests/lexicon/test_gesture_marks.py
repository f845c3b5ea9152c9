"""Gestures that stand in a text between square brackets."""

import time

import pytest

from lexicon.errors import InputError
from lexicon.gesture_names import GESTURES, gesture_name
from lexicon.marked_text import GestureMark, MarkedText, PauseMark
from lexicon.sentences import index_by_letters
from lexicon.text_marks import parse_marks


@pytest.mark.parametrize(
    ("written", "mark"),
    [
        ("shake", {"name": "shake"}),
        ("Nod", {}),
        ("nod .5", {"size": 0.5}),
        ("brows up", {"name": "brows_up"}),
        ("brows_together 1.5", {"name": "brows_together", "size": 1.5}),
        ("look-away", {"name": "look_away"}),
        ("LOOK AWAY down 1.5s", {"name": "look_away", "down_deg": 12.0, "seconds": 1.5}),
        ("wink right", {"name": "wink", "left_deg": -15.0}),
        ("tilt left", {"name": "tilt", "left_deg": 15.0}),
        ("wink left 0.8", {"name": "wink", "left_deg": 15.0, "size": 0.8}),
        ("tilt right 1.5 2s", {"name": "tilt", "left_deg": -15.0, "size": 1.5, "seconds": 2.0}),
        ("look left", {"name": "look_at", "left_deg": 15.0}),
        ("look", {"name": "look_at"}),
        ("look at right 20, up 5, 2 s", {"name": "look_at", "left_deg": -20.0, "down_deg": -5.0, "seconds": 2.0}),
        ("smile 0.7 3s", {"name": "smile", "size": 0.7, "seconds": 3.0}),
    ],
)
def test_gestures_are_marks(written: str, mark: dict) -> None:
    found = parse_marks(f"Well, [{written}]yes.")
    assert (found.text, found.marks) == ("Well, yes.", (GestureMark(6, **mark),))


@pytest.mark.parametrize(
    "text",
    ["[think about it]", "[listen to me]", "[brows]", "[look 5 times]", "[smile at it]", "[nod at him]"],
)
def test_other_words_in_brackets_are_text(text: str) -> None:
    assert parse_marks(f"so {text} here") == MarkedText(f"so {text} here")


@pytest.mark.parametrize("separator", [" ", "-", "_", "  "])
def test_names_are_written_in_several_ways(separator: str) -> None:
    assert {gesture_name(f" {name.replace('_', separator).title()} ") for name in GESTURES} == {*GESTURES}


def test_an_unknown_gesture_is_refused() -> None:
    with pytest.raises(InputError, match="there is no gesture 'wave'; choose nod, shake"):
        GestureMark(0, "wave")


@pytest.mark.parametrize("piece", ["[look ", "[look left]", "[smile 1 1 1 1 ", "[tilt left 1 ,,", "[look at left "])
def test_a_megabyte_is_read_at_once(piece: str) -> None:
    begin = time.perf_counter()
    parse_marks(piece * (1_000_000 // len(piece)))
    parse_marks(f"[{piece[1:] * (200_000 // len(piece))}]")
    assert time.perf_counter() - begin < 10


def test_a_gesture_behind_the_last_word_has_time() -> None:
    found = index_by_letters(parse_marks("Great job. [wink][nod]"))
    assert found.marks == (GestureMark(9, "wink"), GestureMark(9), PauseMark(9, 1.1))
    assert index_by_letters(parse_marks("Bye [smile 4s][pause 0.2]")).marks[1] == PauseMark(3, 0.2)
    assert index_by_letters(parse_marks("Bye [smile 4s]")).marks[1] == PauseMark(3, 1.2)
    assert index_by_letters(parse_marks("[wink]Bye")).marks == (GestureMark(0, "wink"),)
