"""Bounded reading of files and streams that a user gives, as bytes and as UTF-8 text."""

import errno
import os
import re
import stat
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO

from lexicon.errors import DataError

LARGEST_TEXT_BYTES = 16 << 20  # 16 MiB of text to speak; at 15 characters a second about 300 hours
_FILE_KINDS = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
)
_OPEN_DESCRIPTORS = re.compile(r"/dev/(stdin|fd/\d+)|/proc/self/fd/\d+")


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


def is_there(path: Path, is_kind: Callable[[int], bool] = lambda _: True) -> bool:
    """Whether there is a file of a kind, as `stat.S_ISDIR`; an OSError where that cannot be read.

    pathlib says no to a name that is longer than any file's from Python 3.14 on. No file has U+0000 in its name.
    """
    try:
        return "\0" not in str(path) and is_kind(path.stat().st_mode)
    except (FileNotFoundError, NotADirectoryError):
        return False


def is_file(path: Path) -> bool:
    """Whether there is a file of a name, which may be none: longer than any file's, a circle of links, with U+0000."""
    try:
        return is_there(path, stat.S_ISREG)
    except (OSError, ValueError) as refused:
        if isinstance(refused, OSError) and refused.errno not in {errno.ENAMETOOLONG, errno.ELOOP}:
            raise
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
