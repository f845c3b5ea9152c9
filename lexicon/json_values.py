"""Checks of values in parsed JSON and of options; a wrong one is refused with its name, itself, and what to give."""

import json
import math
import sys
from collections.abc import Mapping
from dataclasses import fields
from numbers import Integral, Real
from pathlib import Path
from types import MappingProxyType, NoneType
from typing import Any, get_args

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
    Path: "a path",
})  # fmt: skip


def check_mapping(content: Any) -> dict[str, Any]:
    """A JSON object with any names.

    Raises
    ------
    InputError
        It is no object.
    """
    if not isinstance(content, dict):
        raise InputError(f"give an object in curly brackets, not {format_value(content)}")
    return content


def check_object(content: Any, required: Mapping[str, type], optional: Mapping[str, Any]) -> dict[str, Any]:
    """The parts of a JSON object: all that are required, of their type, and the others with their defaults.

    Raises
    ------
    InputError
        It is no object, has an unknown name, or lacks a required one, or that has another type.
    """
    parts = check_mapping(content)
    for name in parts:
        if name not in required and name not in optional:
            raise InputError(f"there is no {name!r} here; choose {', '.join([*required, *optional])}")
    for name in required:
        if name not in parts:
            raise InputError(f"{name} is missing")
    return {**optional, **parts, **{name: check_type(name, parts[name], kind) for name, kind in required.items()}}


def check_type(name: str, value: Any, kind: type) -> Any:
    """A value of a type of `EXPECTED`; whole numbers become floats where a float is expected, booleans are no numbers.

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
    raise InputError(f"{name} must be {EXPECTED[kind]}, not {format_value(value)}")


def check_list(name: str, value: Any, kind: type) -> list[Any]:
    """A list whose values are all of one type; errors as `check_type`."""
    return [check_type(f"each value of {name}", one, kind) for one in check_type(name, value, list)]


def check_fields(options: Any) -> None:
    """Refuse options, a dataclass, whose values are not of the types of its fields; texts and paths become each other.

    Raises
    ------
    InputError
        A value has another type, is no finite number, or is a path with the character U+0000.
    """
    for one in fields(options):
        value, kinds = getattr(options, one.name), get_args(one.type) or (one.type,)
        if value is None and NoneType in kinds:
            continue
        kind = kinds[0]
        if isinstance(value, str | Path) and kind in (str, Path):
            value = kind(value)
            if kind is Path and "\0" in str(value):
                raise InputError(f"{one.name} is a path with the character U+0000, {format_value(value)}; remove it")
            object.__setattr__(options, one.name, value)
        elif not (isinstance(value, _NUMBERS.get(kind, ())) and is_number(value)):
            check_type(one.name, value, kind)


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


_NUMBERS: Mapping[Any, Any] = MappingProxyType({int: Integral, float: Real})  # also those of numpy and fractions
