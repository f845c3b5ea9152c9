"""Atomic writing of files, and lookup of shipped files."""

import contextlib
import logging
import os
from collections.abc import Collection, Iterator
from functools import cache
from pathlib import Path

from lexicon.errors import BackendError, InputError
from tts2face.storage.temporary import Temporary

SHIPPED_FOLDER = Path(__file__).parents[1] / "data"
# By kind, names that earlier versions shipped and what is used in their place.
FORMER = {"face": {"cartoon": "ada"}, "identity": {"kenji": "ravi", "walter": "erik"}}
LOG = logging.getLogger(__name__)


def write_atomically(path: Path, content: bytes) -> None:
    """Write a file atomically: to a temporary file in the same folder, which is then renamed to `path`.

    Raises
    ------
    BackendError
        The folder cannot be written or the disk is full.
    """
    try:
        with Temporary(path) as temporary:
            temporary.path.write_bytes(content)
            temporary.replace(path)
    except OSError as error:
        raise BackendError(
            f"cannot write {path}: {error.strerror}; free some space or choose another folder"
        ) from error


def find_file(name: str, kind: str) -> Path:
    """Path of a talker, face or palette: a shipped one by name or former name, or the given path.

    Raises
    ------
    InputError
        There is neither a shipped file of this name nor such a path.
    """
    shipped = SHIPPED_FOLDER / f"{name}.{kind}"
    if shipped.parent == SHIPPED_FOLDER and shipped.is_file():
        return shipped
    if Path(name).suffix or Path(name).exists():
        return Path(name)
    if name in FORMER.get(kind, {}):
        _say_new_name(name, kind)
        return SHIPPED_FOLDER / f"{FORMER[kind][name]}.{kind}"
    known = ", ".join(sorted(file.stem for file in SHIPPED_FOLDER.glob(f"*.{kind}")))
    raise InputError(f"there is no {kind} {name!r}; give {known}, or the path of a .{kind} file")


def present_name(name: str, kind: str, offered: Collection[str]) -> str:
    """A name that is offered: the given one, or what is used in place of a former one; else the given name."""
    present = FORMER[kind].get(name, name)
    if name in offered or present not in offered:
        return name
    _say_new_name(name, kind)
    return present


@cache
def _say_new_name(name: str, kind: str) -> None:
    """Warn once in a process."""
    LOG.warning("the %s %s is no longer part of this program; %s is used", kind, name, FORMER[kind][name])


@contextlib.contextmanager
def translate_disk_errors(path: Path) -> Iterator[None]:
    """Translate errors of the operating system into a `BackendError` with the reason.

    Raises
    ------
    BackendError
        An OSError occurred within the block.
    """
    try:
        yield
    except OSError as error:
        reason = os.strerror(error.errno) if error.errno else str(error)
        raise BackendError(f"cannot write {path}: {reason}; free some space or choose another folder") from error
