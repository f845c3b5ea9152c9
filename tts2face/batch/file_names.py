"""Names of outputs."""

from collections.abc import Sequence
from pathlib import Path

from lexicon.errors import InputError


def output_names(files: Sequence[Path]) -> list[str]:
    """Names of outputs: the stems of subtitle files, with their folders or suffixes where stems are equal.

    Raises
    ------
    InputError
        A file is given twice.
    """
    if len({path.resolve() for path in files}) < len(files):
        raise InputError("a subtitle file is given twice; remove one of them")
    for name_of in (
        lambda path: path.stem,
        lambda path: f"{path.resolve().parent.name}-{path.stem}",
        lambda path: f"{path.resolve().parent.name}-{path.name.replace('.', '-')}",
    ):
        names = [name_of(path) for path in files]
        if len(set(names)) == len(names):
            return names
    return [f"{number:03d}-{path.stem}" for number, path in enumerate(files, start=1)]
