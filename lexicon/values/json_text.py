"""Bounded reading of JSON: unique names, complete characters, finite numbers, nesting of limited depth."""

import json
import re
from collections.abc import Iterable
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

from lexicon.errors import DataError, InputError
from lexicon.values.checks import LARGEST_NUMBER
from lexicon.values.files import read_text

LARGEST_JSON_BYTES = 10_000_000  # an hour of timeline spans, one a second in each feature, takes 2 MB
MAX_DEPTH = 64  # nesting of lists, objects and tables; the supported formats need 5
MAX_NUMBER_CHARACTERS = 400  # characters; a double has at most 310 digits before the point
_TOKENS = re.compile(r'"(?:[^"\\]|\\.)*+"?|[\[{]|[\]}]', re.DOTALL)  # a whole string, or one bracket
_SURROGATE = re.compile(r"\\u[dD][89a-fA-F]")
Number = TypeVar("Number", int, float)


def read_json(path: Path) -> Any:
    """Content of a JSON file; errors as `parse_json`, and OSError if the file cannot be opened or read."""
    return parse_json(read_text(path, LARGEST_JSON_BYTES), str(path))


def parse_json(content: str, name: str, *, has_halves: bool = False) -> Any:
    """Content of a JSON text; with `has_halves` one that may contain unpaired surrogates.

    Raises
    ------
    DataError
        It is not JSON, is nested deeper than `MAX_DEPTH`, or contains a number that is too long or not finite, a
        duplicate name in an object, or an unpaired surrogate; the message begins with `name`.
    """
    _check_depth(content, name)
    try:
        parsed = json.loads(
            content,
            object_pairs_hook=_refuse_duplicates,
            parse_constant=_refuse_constant,
            parse_int=partial(_parse_number, kind=int),
            parse_float=partial(_parse_number, kind=float),
        )
    except json.JSONDecodeError as broken:
        raise DataError(f"{name}, line {broken.lineno}: not JSON ({broken.msg}); correct it there") from broken
    except InputError as wrong:
        raise DataError(f"{name}: {wrong}") from wrong
    if not has_halves and _SURROGATE.search(content):
        _check_characters(parsed, name)
    return parsed


def _check_depth(content: str, name: str) -> None:
    depth = 0
    for token in _TOKENS.finditer(content):
        first = token[0][0]
        if first == '"':
            continue
        depth += 1 if first in "[{" else -1
        if depth > MAX_DEPTH:
            raise DataError(f"{name} is nested too deep: at most {MAX_DEPTH} levels of lists and objects are allowed")


def _check_characters(parsed: Any, name: str) -> None:
    try:
        json.dumps(parsed, ensure_ascii=False).encode()
    except UnicodeEncodeError as broken:
        surrogate = f"\\u{ord(broken.object[broken.start]):04x}"
        raise DataError(f"{name} contains the unpaired surrogate {surrogate}; write the whole character") from broken


def _refuse_duplicates(pairs: Iterable[tuple[str, Any]]) -> dict[str, Any]:
    parsed: dict[str, Any] = {}
    for name, value in pairs:
        if name in parsed:
            raise InputError(f"the name {name!r} occurs twice in one object; remove one of them")
        parsed[name] = value
    return parsed


def _refuse_constant(written: str) -> Any:
    raise InputError(f"{written} is not a JSON number; use a finite number")


def _parse_number(written: str, kind: type[Number]) -> Number:
    if len(written) > MAX_NUMBER_CHARACTERS:
        raise InputError(f"a number of {len(written)} characters is too long ({written[:20]}...); shorten it")
    value = kind(written)
    if abs(value) > LARGEST_NUMBER:
        raise InputError(f"the number {written[:20]} is too large; the maximum is 1.8e308")
    return value
