"""Checks of values: a check takes a value and its place, and returns the value or raises what the place says of it.

A kind of file words its refusals in a `Place` of its own; checks of a new kind of value are made by `check_that`.
"""

import json
import math
import sys
from collections.abc import Callable, Mapping
from numbers import Real
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple, Self

from lexicon.errors import InputError, Tts2faceError

LARGEST_NUMBER = sys.float_info.max  # 1.8e308; Python's whole numbers have no limit
MAX_SHOWN_BITS = 200  # of a whole number in a message: 60 digits
MAX_TEXT = 100_000  # characters of one text in a model file
MAX_FREE_DEPTH = 16  # levels of nesting in values of any form
EXPECTED: Mapping[type, str] = MappingProxyType({
    float: "a number",
    int: "a whole number",
    str: "a text in quotes",
    bool: "true or false",
    list: "a list in square brackets",
    dict: "an object in curly brackets",
    Mapping: "an object in curly brackets",
    Path: "a path",
})  # fmt: skip


class Place(NamedTuple):  # not a frozen dataclass: model files have thousands of values, and this is made in a third
    """Place of a value, which words the refusals: here of an option, or of a field of an object in a file.

    Parameters
    ----------
    name
        Name of the value.
    before
        File and path of the object that has the field, with a colon and a space.
    error
        Kind of the errors.
    remedy
        End of each refusal.
    """

    name: str
    before: str = ""
    error: type[Tts2faceError] = InputError
    remedy: str = ""

    def refusal(self, what: str) -> Tts2faceError:
        """Error about the value."""
        return self.error(f"{self.before}{self.name} {what}{self.remedy}")

    def wrong(self, expected: str, value: Any) -> Tts2faceError:
        """Error about a value that is not as expected."""
        return self.refusal(f"must be {expected}, not {self.show(value)}")

    def item(self, part: int | str) -> Self:
        """Place of a value of a list, or of a name in an object."""
        return self._replace(name=f"{'each value' if isinstance(part, int) else part} of {self.name}")

    def show(self, value: Any) -> str:
        """A value in a refusal."""
        return format_value(value)


Check = Callable[[Any, Place], Any]


def check_that(is_right: Callable[[Any], bool], expected: str) -> Check:
    """Check for values that satisfy a condition."""

    def check(value: Any, place: Place) -> Any:
        if not is_right(value):
            raise place.wrong(expected, value)
        return value

    return check


def typed(kind: type) -> Check:
    """Check for values of a type; whole numbers become floats where a float is expected, booleans are no numbers."""
    expected = EXPECTED.get(kind, f"of the type {kind.__name__}")

    def check(value: Any, place: Place) -> Any:
        if kind in (int, float) and isinstance(value, int) and abs(value) > LARGEST_NUMBER:
            raise place.refusal("is too large a number; the maximum is 1.8e308")
        if kind is float and is_number(value):
            return float(value)
        if kind is not float and type(value) is kind:
            return value
        raise place.wrong(expected, value)

    return check


text = check_that(
    lambda value: type(value) is str and len(value) <= MAX_TEXT, f"a text of at most {MAX_TEXT} characters"
)
flag = typed(bool)


def whole(low: int, high: int, expected: str = "a whole number from {} to {}") -> Check:
    """Check for a whole number in [low, high]."""
    return check_that(lambda value: type(value) is int and low <= value <= high, expected.format(low, high))


def number(low: float, high: float, expected: str = "a number from {:g} to {:g}") -> Check:
    """Check for a number in [low, high]."""
    return check_that(lambda value: type(value) in (int, float) and low <= value <= high, expected.format(low, high))


def choice(*values: str) -> Check:
    """Check for one of some texts."""
    expected = f"{', '.join(values[:-1])} or {values[-1]}"
    return check_that(lambda value: type(value) is str and value in values, expected)


def list_of(item: Check, length: int | None = None, expected: str = "") -> Check:
    """Check for a list, of a given length if any, of values that all pass `item`."""
    expected = expected or ("a list" if length is None else f"a list of {length}")

    def check(value: Any, place: Place) -> Any:
        if type(value) is not list or length not in (None, len(value)):
            raise place.wrong(expected, value)
        return [item(element, place.item(at)) for at, element in enumerate(value)]

    return check


def row(*items: Check) -> Check:
    """Check for a list with one check per value."""

    def check(value: Any, place: Place) -> Any:
        if type(value) is not list or len(value) != len(items):
            raise place.wrong(f"a list of {len(items)}", value)
        return [item(element, place.item(at)) for at, (item, element) in enumerate(zip(items, value, strict=True))]

    return check


def record(fields: Mapping[str, Check], optional: Mapping[str, Check] | None = None) -> Check:
    """Check for an object with required and optional names and no others."""
    every = {**fields, **(optional or {})}

    def check(value: Any, place: Place) -> Any:
        is_object(value, place)
        for key in fields:
            if key not in value:
                raise place.refusal(f"lacks {key}")
        for key, element in value.items():
            if key not in every:
                raise place.refusal(f"holds {place.show(key)}, which is not one of {', '.join(every)}")
            every[key](element, place.item(key))
        return value

    return check


def table(item: Check) -> Check:
    """Check for an object with any names, whose values all pass `item`."""

    def check(value: Any, place: Place) -> Any:
        for key, element in is_object(value, place).items():
            item(element, place.item(place.show(key)))
        return value

    return check


is_object = check_that(lambda value: type(value) is dict, "an object")


def anything(value: Any, place: Place, depth: int = MAX_FREE_DEPTH) -> Any:
    """Check the nesting depth and the lengths of the texts of JSON of any form."""
    if type(value) is str:
        text(value, place)
    if depth == 0 and isinstance(value, list | dict):
        raise place.refusal(f"is nested deeper than {MAX_FREE_DEPTH} levels")
    for element in value.values() if isinstance(value, dict) else value if isinstance(value, list) else ():
        anything(element, place, depth - 1)
    return value


free = table(anything)


def check_type(name: str, value: Any, kind: type) -> Any:
    """An option of a type, as `typed`.

    Raises
    ------
    InputError
        It has another type, is no finite number, or is larger than `LARGEST_NUMBER`.
    """
    return typed(kind)(value, Place(name))


def check_limits(what: str, value: float, limits: tuple[float, float], unit: str = "") -> None:
    """Refuse a number outside its limits.

    Raises
    ------
    InputError
        The value is below the lower limit, above the upper one, or not a number.
    """
    low, high = limits
    if not low <= value <= high:
        shown = format_value(value) if isinstance(value, int) else f"{value:.12g}"
        raise InputError(f"{what} must lie between {low:g} and {high:g}{unit}, not {shown}{unit}")


def is_number(value: Any) -> bool:
    """Whether a value is a number that a float can hold, and is no boolean."""
    try:
        return isinstance(value, Real) and not isinstance(value, bool) and math.isfinite(value)
    except OverflowError:
        return False


def format_value(value: Any) -> str:
    """The beginning of a value, for messages."""
    if isinstance(value, int) and value.bit_length() > MAX_SHOWN_BITS:
        return "a number of more than 60 digits"
    try:
        return json.dumps(value, ensure_ascii=False, default=str)[:40]
    except (ValueError, TypeError, RecursionError):  # of Python alone: a list that contains itself, keys of any kind
        return f"a {type(value).__name__}"
