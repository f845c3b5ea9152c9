"""Records of contents: what is accepted, and the sentence about what is not."""

import json
import math
from dataclasses import dataclass, field
from datetime import date
from typing import Annotated, Any

import pytest

from lexicon.errors import DataError, InputError
from lexicon.values.records import checked, errors_at


@dataclass(frozen=True, slots=True)
class Part:
    name: str
    at: Annotated[tuple[float, float], "[x, y]"] = (0.0, 0.0)

    def __post_init__(self) -> None:
        if not self.name:
            raise InputError("a part needs a name; give one")


@dataclass(frozen=True, slots=True)
class Whole:
    count: int
    rate: float = 1.0
    end: float = math.inf
    parts: tuple[Part, ...] = ()
    first: Part | None = None
    by_name: dict[str, Part] = field(default_factory=dict)
    on: bool = False
    muted: frozenset[str] = frozenset()


def test_a_record_has_the_types_of_its_fields() -> None:
    content = {"count": 2, "rate": 3, "parts": [{"name": "a", "at": [1, 2.5]}], "muted": ["b"], "first": None}
    assert checked(Whole, content, "f") == Whole(2, 3.0, parts=(Part("a", (1.0, 2.5)),), muted=frozenset("b"))
    assert isinstance(checked(Whole, content, "f").rate, float)


@pytest.mark.parametrize(("wrong", "sentence"), [
    (3, "f: give an object in curly brackets, not 3"),
    ({}, "f: count is missing"),
    ({"count": 1, "colour": 2}, "f: there is no 'colour' here; choose count, rate, end, parts, first"),
    ({"count": 1.0}, "f: count must be a whole number, not 1.0"),
    ({"count": True}, "f: count must be a whole number, not true"),
    ({"count": "1"}, 'f: count must be a whole number, not "1"'),
    ({"count": 1, "rate": math.nan}, "f: rate must be a number, not NaN"),
    ({"count": 1, "rate": math.inf}, "f: rate must be a number, not Infinity"),
    ({"count": 1, "rate": date(2026, 1, 2)}, 'f: rate must be a number, not {"date": "2026-01-02"}'),
    ({"count": "\ud800"}, "f: unexpected end of hex escape at line 1 column 19"),
    ({"count": json.loads("[" * 300 + "]" * 300)}, "f: recursion limit exceeded at line 1 column 211"),
    ({"count": 1, "on": 1}, "f: on must be true or false, not 1"),
    ({"count": 1, "muted": "a"}, 'f: muted must be a list in square brackets, not "a"'),
    ({"count": 1, "muted": [1]}, "f: muted[0] must be a text in quotes, not 1"),
    ({"count": 1, "parts": [{"name": "a"}, 3]}, "f: parts[1] must be an object in curly brackets, not 3"),
    ({"count": 1, "parts": [{"name": ""}]}, "f, parts[0]: a part needs a name; give one"),
    ({"count": 1, "parts": [{"name": "a", "at": [1]}]}, "f, parts[0]: at must be [x, y], not [1]"),
    ({"count": 1, "parts": [{"name": "a", "at": [1, 2, 3]}]}, "f, parts[0]: at must be [x, y], not [1, 2, 3]"),
    ({"count": 1, "parts": [{"name": "a", "at": [1, "x"]}]}, 'f, parts[0]: at[1] must be a number, not "x"'),
    ({"count": 1, "first": {"title": "a", "name": "b"}}, "f, first: there is no 'title' here; choose name, at"),
    ({"count": 1, "by_name": {"p": {"at": [1, 2]}}}, "f, by_name, p: name is missing"),
])  # fmt: skip
def test_what_is_wrong_is_named_with_its_place(wrong: Any, sentence: str) -> None:
    with pytest.raises(DataError) as refused:
        checked(Whole, wrong, "f")
    assert str(refused.value).removesuffix(", by_name, on, muted") == sentence


def test_the_elements_of_a_list_are_counted_from_its_place() -> None:
    with pytest.raises(InputError, match=r"^f, parts\[1\]: name is missing$"):
        checked(tuple[Part, ...], [{"name": "a"}, {}], "f, parts", InputError)


def test_errors_get_their_place() -> None:
    with pytest.raises(DataError, match=r"^f, parts: wrong$"), errors_at("f, parts"):
        raise InputError("wrong")
