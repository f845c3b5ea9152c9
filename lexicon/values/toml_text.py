"""Bounded reading of TOML: finite numbers, nesting and names of limited depth."""

import re
from typing import Any

from lexicon.errors import DataError
from lexicon.values.checks import Place, typed
from lexicon.values.json_text import MAX_DEPTH

_QUOTED = re.compile(r'"(?:[^"\\]|\\.)*+"?|\'[^\']*+\'?')  # a text on one line of TOML, closed or not


def parse_toml(content: str, name: str) -> dict[str, Any]:
    """Content of a TOML text.

    Raises
    ------
    DataError
        It is not TOML, is nested deeper than `MAX_DEPTH`, or contains a number that is too large or not finite; the
        message begins with `name`.
    """
    import tomllib

    for number, line in enumerate(content.split("\n"), 1):  # tomllib takes n^2 to n^3 steps for a key of n parts
        if line.count(".") > MAX_DEPTH < _QUOTED.sub("", line).partition("#")[0].count("."):
            raise DataError(
                f"{name}, line {number}: has more than {MAX_DEPTH} dots outside quotes; shorten its keys or divide it"
            )
    try:
        parsed = tomllib.loads(content)
    except tomllib.TOMLDecodeError as broken:
        raise DataError(f"{name} is not TOML ({broken}); correct it there") from broken
    except RecursionError as deep:
        raise DataError(f"{name} is not TOML of at most {MAX_DEPTH} levels of tables; nest it less") from deep
    except ValueError as long:  # a whole number of more than 4,300 digits
        raise DataError(f"{name} contains a number of thousands of digits; shorten it") from long
    _check_tables(parsed, name)
    return parsed


def _check_tables(parsed: dict[str, Any], name: str) -> None:
    """Check the numbers and the depth of parsed TOML."""
    level: list[tuple[str, Any]] = list(parsed.items())
    for _ in range(MAX_DEPTH):
        inner: list[tuple[str, Any]] = []
        for key, value in level:
            if isinstance(value, dict):
                inner += value.items()
            elif isinstance(value, list):
                inner += [(key, item) for item in value]
            elif type(value) in (int, float):
                typed(type(value))(value, Place(key[:40], f"{name}: ", DataError))
        level = inner
    if level:
        raise DataError(f"{name} is nested too deep: at most {MAX_DEPTH} levels of tables and lists are allowed")
