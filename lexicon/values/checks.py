"""Checks of single values and of lists of them: type, finite, within limits.

A wrong value is refused with its name, itself, and what to give.
"""

import json
import math
import sys
from collections.abc import Mapping
from numbers import Real
from pathlib import Path
from types import MappingProxyType
from typing import Any

from lexicon.errors import InputError

LARGEST_NUMBER = sys.float_info.max  # 1.8e308; Python's whole numbers have no limit
MAX_SHOWN_BITS = 200  # of a whole number in a message: 60 digits
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


def check_type(name: str, value: Any, kind: type) -> Any:
    """A value of a type; whole numbers become floats where a float is expected, booleans are no numbers.

    Raises
    ------
    InputError
        It has another type, is no finite number, or is larger than `LARGEST_NUMBER`.
    """
    if kind in (int, float) and isinstance(value, int) and abs(value) > LARGEST_NUMBER:
        raise InputError(f"{name} is too large a number; the maximum is 1.8e308")
    if kind is float and is_number(value):
        return float(value)
    if kind is not float and type(value) is kind:
        return value
    expected = EXPECTED.get(kind, f"of the type {kind.__name__}")
    raise InputError(f"{name} must be {expected}, not {format_value(value)}")


def check_list(name: str, value: Any, kind: type) -> list[Any]:
    """A list whose values are all of one type; errors as `check_type`."""
    return [check_type(f"each value of {name}", one, kind) for one in check_type(name, value, list)]


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
