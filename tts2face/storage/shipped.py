"""Lookup of shipped files by name."""

import logging
from collections.abc import Collection
from functools import cache
from pathlib import Path

from lexicon.errors import InputError
from lexicon.values.files import is_there

SHIPPED_FOLDER = Path(__file__).parents[1] / "data"
# By kind, names that earlier versions shipped and what is used in their place.
FORMER = {"face": {"cartoon": "ada"}, "identity": {"kenji": "ravi", "walter": "erik"}}
LOG = logging.getLogger(__name__)


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
    if Path(name).suffix or is_there(Path(name)):
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
