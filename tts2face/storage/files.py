"""Files that appear whole or not at all, and those that are shipped."""

from pathlib import Path

from lexicon.errors import BackendError, InputError
from tts2face.storage.temporary import Temporary

SHIPPED_FOLDER = Path(__file__).parents[1] / "data"


def write_atomically(path: Path, content: bytes) -> None:
    """Write a file beside `path`, then rename it, so that no half file is ever seen.

    Raises
    ------
    BackendError
        The folder cannot be written or the disk is full.
    """
    try:
        with Temporary(path) as beside:
            beside.path.write_bytes(content)
            beside.replace(path)
    except OSError as refused:
        raise BackendError(
            f"cannot write {path}: {refused.strerror}; free some space or choose another folder"
        ) from refused


def find_file(name: str, kind: str) -> Path:
    """Where a talker, face or palette lies: a shipped one by name, or a path.

    Raises
    ------
    InputError
        There is neither.
    """
    shipped = SHIPPED_FOLDER / f"{name}.{kind}"
    if shipped.parent == SHIPPED_FOLDER and shipped.is_file():
        return shipped
    if Path(name).suffix or Path(name).exists():
        return Path(name)
    known = ", ".join(sorted(file.stem for file in SHIPPED_FOLDER.glob(f"*.{kind}")))
    raise InputError(f"there is no {kind} {name!r}; give {known}, or the path of a .{kind} file")
