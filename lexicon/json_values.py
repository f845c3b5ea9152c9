"""Checks of the values in parsed JSON; a wrong one is refused with its name, itself, and what to give."""

import json
import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from lexicon.errors import InputError

EXPECTED: Mapping[type, str] = MappingProxyType({
    float: "a number",
    int: "a whole number",
    str: "a text in quotes",
    bool: "true or false",
    list: "a list in square brackets",
    dict: "an object in curly brackets",
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
        It has another type, or is infinite or too large for a float.
    """
    if kind is float and is_number(value):
        return _as_float(name, value)
    if kind is not float and type(value) is kind:
        return value
    raise InputError(f"{name} must be {EXPECTED[kind]}, not {format_value(value)}")


def check_list(name: str, value: Any, kind: type) -> list[Any]:
    """A list whose values are all of one type; errors as `check_type`."""
    return [check_type(f"each value of {name}", one, kind) for one in check_type(name, value, list)]


def is_number(value: Any) -> bool:
    """Whether a value is a number of JSON, which has no infinity, and is no boolean."""
    return isinstance(value, int | float) and not isinstance(value, bool) and -math.inf < value < math.inf


def format_value(value: Any) -> str:
    """The beginning of a value, for messages."""
    return json.dumps(value, ensure_ascii=False)[:40]


def _as_float(name: str, value: float) -> float:
    try:
        return float(value)
    except OverflowError as huge:
        raise InputError(f"{name} is too large a number") from huge
