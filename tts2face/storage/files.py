"""Atomic writing of files, and lookup of shipped files.

Checks of output paths, made before the computation whose result they receive.

Protection of inputs against being overwritten by outputs.

Folders of the current user for cached files and for data.
"""

import contextlib
import errno
import logging
import os
import re
import stat
import sys
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path

from lexicon.errors import BackendError, InputError
from lexicon.values.files import is_there
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


def is_disk_full(error: BaseException) -> bool:
    """Whether an error says that a disk, or the share of it that a user may have, is full."""
    return isinstance(error, OSError) and error.errno in {errno.ENOSPC, errno.EDQUOT}


MOVIE_SUFFIXES = (".mp4", ".webm", ".mov", ".gif")
LONGEST_NAME = 255  # bytes; used if the file system does not report a limit
HIDDEN_EXTRA = 16  # bytes that the name of the temporary file adds: dots and random letters
_SUFFIX_ALONE = re.compile(r"\.\w{2,7}")
_FOLDERS = re.compile(r"(?<![\w.:/])/(?:[^/\s'\"]+/)+")  # of a path, not of a URL


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


def user_cache() -> Path:
    """Cache folder of the current user."""
    if sys.platform == "win32":
        base = os.environ.get("LOCALAPPDATA") or str(Path.home() / "AppData" / "Local")
    elif sys.platform == "darwin":
        base = str(Path.home() / "Library" / "Caches")
    else:
        base = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(base) / "tts2face"


def user_data() -> Path:
    """Folder of the current user for data that programs keep."""
    if sys.platform == "win32":
        base = os.environ.get("LOCALAPPDATA") or str(Path.home() / "AppData" / "Local")
    elif sys.platform == "darwin":
        base = str(Path.home() / "Library" / "Application Support")
    else:
        base = os.environ.get("XDG_DATA_HOME") or str(Path.home() / ".local" / "share")
    return Path(base) / "tts2face"


def without_folders(message: str, folders: Iterable[Path]) -> str:
    """A message that names files of these folders by their names alone, for readers on other machines."""
    for folder in sorted(folders, reverse=True):  # a folder after those within it
        message = message.replace(f"{folder}/", "")
    return message


def without_paths(message: str) -> str:
    """A message that names all files by their names alone."""
    return _FOLDERS.sub("", message)
