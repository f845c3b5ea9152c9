"""Files and streams that a user names, read to a stated size and no further: text in UTF-8, and JSON."""

import json
import re
import stat
from collections.abc import Iterable
from pathlib import Path
from typing import Any, BinaryIO

from lexicon.errors import DataError, InputError

LARGEST_TEXT_BYTES = 16 << 20  # 16 MiB of text to speak; at 15 characters a second some 300 hours
LARGEST_JSON_BYTES = 10_000_000  # an hour of timeline spans, one a second in each feature, takes 2 MB
DEEPEST = 64  # lists and objects within each other; the formats read here need 5
LONGEST_NUMBER = 400  # characters; a double written out in full has at most 310 before the point
_FILE_KINDS = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
)
_TOKENS = re.compile(r'"(?:[^"\\]|\\.)*+"?|[\[{]|[\]}]', re.DOTALL)  # a string as a whole, or one bracket
_SURROGATE = re.compile(r"\\u[dD][89a-fA-F]")


def check_regular_file(path: Path) -> None:
    """Refuse what is no ordinary file: opening a pipe waits for its writer, reading a device may never end.

    Raises
    ------
    DataError
        The path is a folder, a pipe, a socket or a device, a link that leads nowhere, or cannot be looked at.
    """
    try:
        mode = path.stat().st_mode
    except OSError as refused:
        raise DataError(f"{path} cannot be read ({refused.strerror}); check the path") from refused
    kind = next((name for is_kind, name in _FILE_KINDS if is_kind(mode)), None)
    if kind is not None:
        raise DataError(f"{path} is {kind}, not a file; remove it or give a file")


def read_bounded(file: BinaryIO, name: str, largest: int) -> bytes:
    """All bytes of an open file or stream, which may be a pipe.

    Raises
    ------
    DataError
        It holds more than `largest` bytes; no more than that is read.
    """
    content = file.read(largest + 1)
    if len(content) > largest:
        raise DataError(f"{name} holds more than {largest / 1e6:.0f} MB; split it into smaller files")
    return content


def decoded(content: bytes, name: str) -> str:
    """Characters of UTF-8 bytes, with or without byte order mark.

    Raises
    ------
    DataError
        They are not UTF-8; the message names the first wrong byte.
    """
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as broken:
        raise DataError(f"{name} is not UTF-8 text (byte {broken.start}); save it as UTF-8") from broken


def read_text(path: Path, largest: int = LARGEST_TEXT_BYTES) -> str:
    """Characters of a UTF-8 file or pipe.

    Raises
    ------
    OSError
        It cannot be opened or read.
    DataError
        It holds more than `largest` bytes, or is not UTF-8.
    """
    with path.open("rb") as file:
        return decoded(read_bounded(file, str(path), largest), str(path))


def read_json(path: Path) -> Any:
    """What a JSON file holds; errors as `parse_json`, and OSError where the file cannot be opened or read."""
    return parse_json(read_text(path, LARGEST_JSON_BYTES), str(path))


def parse_json(content: str, name: str) -> Any:
    """What a JSON text holds.

    Raises
    ------
    DataError
        It is not JSON, is nested deeper than `DEEPEST`, holds a number that is too long or not finite, an object with
        the same name twice, or half of a surrogate pair; the message begins with `name`.
    """
    _check_depth(content, name)
    try:
        parsed = json.loads(
            content,
            object_pairs_hook=_refuse_duplicates,
            parse_constant=_constant,
            parse_int=_integer,
            parse_float=_number,
        )
    except json.JSONDecodeError as broken:
        raise DataError(f"{name}, line {broken.lineno}: not JSON ({broken.msg}); correct it there") from broken
    except InputError as wrong:
        raise DataError(f"{name}: {wrong}") from wrong
    if _SURROGATE.search(content):
        _check_characters(parsed, name)
    return parsed


def _check_depth(content: str, name: str) -> None:
    depth = 0
    for token in _TOKENS.finditer(content):
        first = token[0][0]
        if first == '"':
            continue
        depth += 1 if first in "[{" else -1
        if depth > DEEPEST:
            raise DataError(f"{name} is nested too deep: more than {DEEPEST} lists and objects within each other")


def _check_characters(parsed: Any, name: str) -> None:
    try:
        json.dumps(parsed, ensure_ascii=False).encode()
    except UnicodeEncodeError as broken:
        half = f"\\u{ord(broken.object[broken.start]):04x}"
        raise DataError(f"{name} holds {half}, half of a surrogate pair; write the whole character") from broken


def _refuse_duplicates(pairs: Iterable[tuple[str, Any]]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for name, value in pairs:
        if name in found:
            raise InputError(f"{name!r} stands twice in one object; keep one")
        found[name] = value
    return found


def _constant(written: str) -> Any:
    raise InputError(f"{written} is no number of JSON; JSON numbers are finite")


def _integer(written: str) -> int:
    _check_length(written)
    return int(written)


def _number(written: str) -> float:
    _check_length(written)
    value = float(written)
    if value in (float("inf"), float("-inf")):
        raise InputError(f"the number {written[:20]} is too large; the largest is 1.8e308")
    return value


def _check_length(written: str) -> None:
    if len(written) > LONGEST_NUMBER:
        raise InputError(f"a number of {len(written)} characters is too long ({written[:20]}...); shorten it")
