"""The file of a report: which kind its suffix names."""

from collections.abc import Mapping
from pathlib import Path
from typing import TypeVar

from corpus_tools.report.drawing import load_matplotlib
from lexicon.errors import InputError

Writer = TypeVar("Writer")
DRAWN = (".html", ".png")  # kinds of file that hold plots


def report_writer(out: Path, writers: Mapping[str, Writer]) -> Writer:
    """The writer for a file's suffix; checked before the work begins.

    Raises
    ------
    InputError
        There is no writer for the suffix, or no folder for the file.
    BackendError
        The file has plots, and matplotlib is not installed.
    """
    suffix = out.suffix.lower()
    if suffix not in writers:
        raise InputError(f"a report is written as {', '.join(writers)}, not {out.name}")
    if not out.parent.is_dir():
        raise InputError(f"there is no folder {out.parent}; make it or choose another")
    if suffix in DRAWN:
        load_matplotlib()
    return writers[suffix]
