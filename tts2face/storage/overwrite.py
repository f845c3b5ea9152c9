"""Protection of inputs against being overwritten by outputs."""

import os
from collections.abc import Mapping
from pathlib import Path

from lexicon.errors import InputError

OUTPUT_SUFFIXES = frozenset(
    {".talker", ".face", ".palette", ".html"}
)  # outputs that are never inputs in a folder of recordings
AnyPath = Path | str | None


def refuse_overwriting(outputs: Mapping[str, AnyPath], inputs: Mapping[str, AnyPath]) -> None:
    """Check that no output replaces an input or another output.

    Files are compared instead of names: relative paths, symbolic links and hard links are recognised.

    Parameters
    ----------
    outputs, inputs
        Paths by option name, such as ``--out``; None is ignored. An input may be a folder; text without a suffix is
        the name of a shipped file, not a path.

    Raises
    ------
    InputError
        An output is an input, contains one, or replaces a possible input in a folder of inputs; or two outputs are the
        same file.
    """
    written = [(name, Path(path)) for name, path in outputs.items() if path is not None]
    read = [(name, Path(path)) for name, path in inputs.items() if path is not None and _is_path(path)]
    for at, (name, output) in enumerate(written):
        for other, earlier in written[:at]:
            if _is_same(output, earlier):
                raise InputError(f"{other} and {name} are the same file {output}; choose two names")
        for source, given in read:
            if _is_same(output, given):
                raise InputError(f"{name} {output} would replace {source}; choose another name")
            if output.is_dir() and _lies_in(given, output):
                raise InputError(
                    f"{name} {output} would replace the folder that contains {source}; choose another name"
                )
            if given.is_dir() and output.exists() and output.suffix not in OUTPUT_SUFFIXES and _lies_in(output, given):
                raise InputError(f"{name} {output} would replace a file of {source}; choose another name")


def _is_path(given: Path | str) -> bool:
    return os.path.lexists(given) and (isinstance(given, Path) or Path(given).suffix != "")


def _is_same(one: Path, other: Path) -> bool:
    if one.exists() and other.exists():
        return one.samefile(other)
    return os.path.realpath(one) == os.path.realpath(other)


def _lies_in(path: Path, folder: Path) -> bool:
    """Whether a path lies in a folder, as given or after resolving links."""
    inside = Path(os.path.realpath(folder))
    return inside in Path(os.path.realpath(path)).parents or inside in Path(os.path.abspath(path)).parents
