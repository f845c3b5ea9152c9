"""Lookup of shipped files by name."""

from pathlib import Path

from lexicon.errors import InputError
from lexicon.values.files import is_there

SHIPPED_FOLDER = Path(__file__).parents[1] / "data"


def find_file(name: str, kind: str) -> Path:
    """Path of a talker, face or palette: a shipped one by name, or the given path.

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
    known = ", ".join(sorted(file.stem for file in SHIPPED_FOLDER.glob(f"*.{kind}")))
    raise InputError(f"there is no {kind} {name!r}; give {known}, or the path of a .{kind} file")
