"""Directions, and words in brackets that are none."""

import pytest

from lexicon.directions import find_direction
from lexicon.mark_table import shipped_marks


@pytest.mark.parametrize(
    ("words", "is_one"),
    [
        ("sighs", True), ("rolls eyes", True), ("laughing", True), ("cries", True), ("nervously", True),
        ("happy", True), ("winning", False), ("very", False), ("not now", False), ("", False), ("nod", True),
        ("think", False), ("in a sad voice", True), ("EMOTION: angry", True), ("mood=purple", True), ("walks in", True),
        ("Walks in", False), ("looks good", False), ("the door creaks", False), ("sic", False), ("2 laughs", False),
    ],
)  # fmt: skip
def test_directions_in_square_brackets(words: str, is_one: bool) -> None:
    found = find_direction(words, shipped_marks(), is_first=True, is_strict=False)
    assert (found is not None) == is_one


@pytest.mark.parametrize(
    ("words", "is_one"),
    [
        ("laughs", True), ("smiles warmly", True), ("happy", True), ("about two hours", False), ("very happy", False),
        ("looking for more", False), ("thinks for a moment", True), ("walks in", False), ("the younger one", False),
    ],
)  # fmt: skip
def test_parentheses_are_read_more_strictly(words: str, is_one: bool) -> None:
    found = find_direction(words, shipped_marks(), is_first=True, is_strict=True)
    assert (found is not None) == is_one


@pytest.mark.parametrize(
    ("words", "style", "gesture"),
    [
        ("smiles warmly", "happy", "smile"), ("gulps nervously", "afraid", "surprise"), ("shakes head", "", "shake"),
        ("shakes hands", "", None), ("rolls his eyes", "", "look_away"), ("mood: worried", "afraid", None),
        ("emotion: exasperated", "disgusted", None), ("style: head=calm", "head=calm", None),
    ],
)  # fmt: skip
def test_what_directions_show(words: str, style: str, gesture: str | None) -> None:
    found = find_direction(words, shipped_marks(), is_first=True, is_strict=False)
    assert found is not None
    assert next((mark.style for mark in reversed(found.marks) if mark.style), "") == style
    assert next((mark.gesture.name for mark in found.marks if mark.gesture), None) == gesture
