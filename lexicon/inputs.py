"""Bounded reading of files and streams given by a user: UTF-8 text, JSON, TOML and CSV.

Checks of values in parsed JSON and of options; a wrong one is refused with its name, itself, and what to give.
"""

import csv
import errno
import json
import math
import operator
import os
import re
import stat
import sys
from collections.abc import Callable, Iterable, Mapping
from dataclasses import fields
from functools import cache, partial
from io import StringIO
from itertools import repeat
from numbers import Integral, Real
from pathlib import Path
from types import MappingProxyType, UnionType
from typing import Annotated, Any, BinaryIO, TypeVar, get_args, get_origin

from lexicon.errors import DataError, InputError

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


def check_fields(options: Any) -> None:
    """Refuse options, a dataclass, whose values are not of the types of its fields.

    Texts and paths become each other, and lists tuples or sets. A value that equals the default is not checked: it may
    be infinite.

    Raises
    ------
    InputError
        A value has another type, is no finite number, or is a path with the character U+0000.
    """
    for name, kind, default in _fields_of(options.__class__):
        value = getattr(options, name)
        if type(value) is type(default) and value == default:
            continue
        found = _convert(name, value, kind)
        if found is not value:
            object.__setattr__(options, name, found)


@cache
def _fields_of(options: type) -> tuple[tuple[str, Any, Any], ...]:
    """Name, annotation and default of each field of a dataclass."""
    return tuple((one.name, one.type, one.default) for one in fields(options))


def _convert(name: str, value: Any, kind: Any) -> Any:
    """A value of the type of an annotation, itself where nothing is converted; errors as `check_fields`."""
    if type(value) is kind and kind in _PLAIN and _PLAIN[kind](value):  # of curves and words, of which there are many
        return value
    origin, inner = _parts(kind)
    if origin is UnionType and value is None:
        return None
    if origin in (UnionType, Annotated):  # X | None
        return _convert(name, value, inner[0])
    if origin in (tuple, frozenset):
        return _convert_list(name, value, origin, inner)
    if origin is Mapping and isinstance(value, Mapping):
        found = {_convert(f"each name of {name}", key, inner[0]): one for key, one in value.items()}
        found = {key: _convert(f"{key} of {name}", one, inner[1]) for key, one in found.items()}
        return value if all(found.get(key) is one for key, one in value.items()) else found
    return _convert_single(name, value, origin or kind)


def _convert_single(name: str, value: Any, kind: Any) -> Any:
    if kind in (str, Path) and isinstance(value, str | Path):
        if kind is Path and "\0" in str(value):
            raise InputError(f"{name} is a path with the character U+0000, {format_value(value)}; remove it")
        return kind(value)
    if kind in _NUMBERS:
        is_right = isinstance(value, _NUMBERS[kind]) and is_number(value)
    else:
        is_right = kind is Any or (kind not in EXPECTED and isinstance(value, kind))
    return value if is_right else check_type(name, value, kind)


def _convert_list(name: str, value: Any, kind: Any, inner: tuple[Any, ...]) -> Any:
    """A tuple or set of values of one type, or a tuple of one type for each of its values."""
    if not isinstance(value, list | kind):
        raise InputError(f"{name} must be {EXPECTED[list]}, not {format_value(value)}")
    is_fixed, each = kind is tuple and inner[-1] is not Ellipsis, f"each value of {name}"
    if is_fixed and len(value) != len(inner):
        raise InputError(f"{name} must be a list of {len(inner)} values, not of {len(value)}")
    kinds = inner if is_fixed else repeat(inner[0])
    found = [_convert(each, one, of) for one, of in zip(value, kinds, strict=False)]
    is_same = isinstance(value, kind) and all(map(operator.is_, value, found))
    return value if is_same else kind(found)


@cache
def _parts(kind: Any) -> tuple[Any, tuple[Any, ...]]:
    """Origin and arguments of an annotation."""
    return get_origin(kind), get_args(kind)


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


_PLAIN: Mapping[Any, Callable[[Any], bool]] = MappingProxyType(
    {str: lambda _: True, float: math.isfinite, int: lambda value: value.bit_length() < sys.float_info.max_exp}
)
_NUMBERS: Mapping[Any, Any] = MappingProxyType({int: Integral, float: Real})  # also those of numpy and fractions


LARGEST_TEXT_BYTES = 16 << 20  # 16 MiB of text to speak; at 15 characters a second about 300 hours
LARGEST_JSON_BYTES = 10_000_000  # an hour of timeline spans, one a second in each feature, takes 2 MB
LARGEST_TABLE_BYTES = 200_000_000  # an hour of Live Link Face at 60 frames/s takes 180 MB
MAX_DEPTH = 64  # nesting of lists, objects and tables; the supported formats need 5
MAX_NUMBER_CHARACTERS = 400  # characters; a double has at most 310 digits before the point
_FILE_KINDS = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
)
_OPEN_DESCRIPTORS = re.compile(r"/dev/(stdin|fd/\d+)|/proc/self/fd/\d+")
_TOKENS = re.compile(r'"(?:[^"\\]|\\.)*+"?|[\[{]|[\]}]', re.DOTALL)  # a whole string, or one bracket
_QUOTED = re.compile(r'"(?:[^"\\]|\\.)*+"?|\'[^\']*+\'?')  # a text on one line of TOML, closed or not
_SURROGATE = re.compile(r"\\u[dD][89a-fA-F]")
Number = TypeVar("Number", int, float)


def check_regular_file(path: Path) -> None:
    """Refuse anything but a regular file: opening a pipe waits for its writer, reading a device may never end.

    Raises
    ------
    DataError
        The path is a folder, a pipe, a socket, a device or a broken link, or cannot be accessed.
    """
    try:
        mode = path.stat().st_mode
    except OSError as refused:
        raise DataError(f"{path} cannot be read ({refused.strerror}); check the path") from refused
    _check_kind(path, mode)


def _check_kind(path: Path, mode: int) -> None:
    kind = next((name for is_kind, name in _FILE_KINDS if is_kind(mode)), None)
    if kind is not None:
        raise DataError(f"{path} is {kind}, not a file; remove it or use a file")


def is_file(path: Path) -> bool:
    """Whether there is a file of a name, which may be longer than any file's."""
    try:
        return path.is_file()
    except OSError as refused:
        if refused.errno != errno.ENAMETOOLONG:
            raise
        return False


def is_there(path: Path, is_kind: Callable[[int], bool] = lambda _: True) -> bool:
    """Whether there is a file of a kind, as `stat.S_ISDIR`; an OSError where that cannot be told.

    pathlib says no to a name that is longer than any file's from Python 3.14 on.
    """
    try:
        return is_kind(path.stat().st_mode)
    except (FileNotFoundError, NotADirectoryError):
        return False


def read_bounded(file: BinaryIO, name: str, largest: int) -> bytes:
    """All bytes of an open file or stream, including pipes.

    Raises
    ------
    DataError
        It contains more than `largest` bytes; no more than that is read.
    """
    content = file.read(largest + 1)
    if len(content) > largest:
        raise DataError(f"{name} contains more than {largest / 1e6:.0f} MB; split it into smaller files")
    return content


def decode_utf8(content: bytes, name: str) -> str:
    """Decode UTF-8 bytes, with or without byte order mark.

    Raises
    ------
    DataError
        They are not UTF-8; the message names the first invalid byte.
    """
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as broken:
        raise DataError(f"{name} is not UTF-8 text (byte {broken.start}); save it as UTF-8") from broken


def read_text(path: Path, largest: int = LARGEST_TEXT_BYTES, *, may_be_pipe: bool = False) -> str:
    """Text of a UTF-8 file, or of a pipe that is open already, as ``/dev/stdin``.

    Parameters
    ----------
    may_be_pipe
        Whether any pipe or device is read, too, as long as it lasts, and its writer is waited for.

    Raises
    ------
    OSError
        It cannot be opened or read.
    DataError
        It is another pipe or a device, contains more than `largest` bytes, or is not UTF-8.
    """
    is_pipe = may_be_pipe or _OPEN_DESCRIPTORS.fullmatch(str(path))
    with open(path, "rb", opener=None if is_pipe else _open_at_once) as file:
        if not is_pipe:
            _check_kind(path, os.fstat(file.fileno()).st_mode)
        return decode_utf8(read_bounded(file, str(path), largest), str(path))


def _open_at_once(name: str, flags: int) -> int:
    """Open a file without waiting for the writer of a pipe."""
    return os.open(name, flags | getattr(os, "O_NONBLOCK", 0))  # which Windows lacks


def read_table(path: Path, largest: int = LARGEST_TABLE_BYTES, delimiters: str = ",") -> list[list[str]]:
    """Rows of a CSV file, without empty ones, divided by the delimiter that its first row has most.

    Raises
    ------
    DataError
        It cannot be read, contains more than `largest` bytes, or is not CSV in UTF-8.
    """
    try:
        text = read_text(path, largest)
        delimiter = max(delimiters, key=text.partition("\n")[0].count)
        return [row for row in csv.reader(StringIO(text, newline=""), delimiter=delimiter) if row]
    except OSError as refused:
        raise DataError(f"{path} cannot be read ({refused.strerror}); check the file") from refused
    except csv.Error as broken:
        raise DataError(f"{path} is not a CSV file ({broken}); export it again") from broken


def parse_cell(text: str, path: Path, line: int, unit: str = "") -> float:
    """Finite number in a cell of a table.

    Raises
    ------
    DataError
        It is none; the message names the line, and the unit if there is one.
    """
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise DataError(f"{path}, line {line}: {text!r} is not a number{unit and ' of ' + unit}; correct it")
    return value


def read_json(path: Path) -> Any:
    """Content of a JSON file; errors as `parse_json`, and OSError if the file cannot be opened or read."""
    return parse_json(read_text(path, LARGEST_JSON_BYTES), str(path))


def parse_json(content: str, name: str) -> Any:
    """Content of a JSON text.

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
    if _SURROGATE.search(content):
        _check_characters(parsed, name)
    return parsed


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
                inner += [(key, one) for one in value]
            elif type(value) in (int, float):
                _check_number(key, value, name)
        level = inner
    if level:
        raise DataError(f"{name} is nested too deep: at most {MAX_DEPTH} levels of tables and lists are allowed")


def _check_number(key: str, value: float, name: str) -> None:
    try:
        check_type(key[:40], value, type(value))
    except InputError as wrong:
        raise DataError(f"{name}: {wrong}") from wrong


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
