"""Checks of output paths, made before the computation whose result they receive: names, folders, no input replaced."""

import os
import re
import stat
from collections.abc import Mapping, Sequence
from pathlib import Path

from lexicon.errors import BackendError, InputError
from lexicon.values.files import is_there

MOVIE_SUFFIXES = (".mp4", ".webm", ".mov", ".gif")
LONGEST_NAME = 255  # bytes; used if the file system does not report a limit
HIDDEN_EXTRA = 16  # bytes that the name of the temporary file adds: dots and random letters
_SUFFIX_ALONE = re.compile(r"\.\w{2,7}")
# Of outputs that are never inputs in a folder of recordings.
OUTPUT_SUFFIXES = frozenset({".talker", ".face", ".palette", ".html"})
AnyPath = Path | str | None


def check_name(path: Path) -> None:
    """Check that a file or folder can be created at a path.

    Raises
    ------
    InputError
        The name is only a suffix or too long, or the parent folder does not exist.
    BackendError
        The folder cannot be written.
    """
    _check_stem(path)
    try:
        is_folder = is_there(path.parent, stat.S_ISDIR)
    except OSError as error:
        raise InputError(f"cannot write {short_name(path)}: {error.strerror}; choose another folder") from error
    if not is_folder:
        raise InputError(f"there is no folder {path.parent} to write {path.name} to; create it first")
    longest = _longest_name(path.parent) - HIDDEN_EXTRA
    if (length := len(os.fsencode(path.name))) > longest:
        raise InputError(f"the name {short_name(path)} has {length} bytes; use at most {longest}")
    if not os.access(path.parent, os.W_OK | os.X_OK):
        raise BackendError(f"cannot write {path}: Permission denied; choose another folder")


def check_file_name(path: Path, what: str, suffixes: Sequence[str]) -> None:
    """Check that a file with one of the suffixes can be written at a path; further errors as `check_name`.

    Raises
    ------
    InputError
        The path has another suffix, or is a folder.
    """
    _check_stem(path)
    if path.suffix not in suffixes:
        raise InputError(f"{what} is written as {', '.join(suffixes)}, not {short_name(path)}")
    check_name(path)
    if path.is_dir():
        raise InputError(f"{path} is a folder; choose another name")


def short_name(path: Path) -> str:
    """Name of a path for a message, shortened to at most 60 characters."""
    return path.name if len(path.name) <= 60 else f"{path.name[:40]}...{path.name[-10:]}"


def _check_stem(path: Path) -> None:
    if _SUFFIX_ALONE.fullmatch(path.name):
        raise InputError(f"{path} is only a suffix; put a name before it, such as clip{path.name}")


def _longest_name(folder: Path) -> int:
    try:
        return os.pathconf(folder, "PC_NAME_MAX")
    except (AttributeError, OSError, ValueError):  # not available on Windows, or unknown
        return LONGEST_NAME


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
    read = [
        (name, Path(path))
        for name, path in inputs.items()
        if path is not None and os.path.lexists(path) and (isinstance(path, Path) or Path(path).suffix)
    ]
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


def _is_same(path: Path, other: Path) -> bool:
    # links, and file systems without capitals, give one file two names
    if path.exists() and other.exists():
        return path.samefile(other)
    return os.path.realpath(path) == os.path.realpath(other)


def _lies_in(path: Path, folder: Path) -> bool:
    """Whether a path lies in a folder, as given or after resolving links."""
    inside = Path(os.path.realpath(folder))
    return inside in Path(os.path.realpath(path)).parents or inside in Path(os.path.abspath(path)).parents
