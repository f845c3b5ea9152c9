"""Decorators that compile kernels with numba, and the folder in which the compiled code is kept.

Every kernel of the package is compiled by these decorators, so numba is imported here only, and finds a folder that it
can write even where neither the installed package nor the user's cache folder can be written.
"""

import os
import stat
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import ParamSpec, TypeVar

import numba

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")
CACHE_VARIABLE = "NUMBA_CACHE_DIR"  # where the user wants compiled kernels; numba reads it itself


def kernel(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """A function compiled at its first call and kept on disk; it runs without the interpreter's lock."""
    compiled: Callable[Arguments, Result] = numba.njit(cache=True, nogil=True, error_model="numpy")(function)
    return compiled


def vectorized_kernel(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """A kernel of plain loops over long arrays, compiled for the vector unit: sums may be reordered."""
    compiled: Callable[Arguments, Result] = numba.njit(cache=True, nogil=True, error_model="numpy", fastmath=True)(
        function
    )
    return compiled


def inlined_kernel(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """A piece of a kernel, compiled within each kernel that calls it."""
    compiled: Callable[Arguments, Result] = numba.njit(inline="always", error_model="numpy")(function)
    return compiled


def cache_folder(package: Path) -> Path | None:
    """A private folder for compiled kernels; None where numba's own choice can be written."""
    if CACHE_VARIABLE in os.environ or _can_write(package / "__pycache__") or _can_write(_user_cache_folder()):
        return None
    return _private_folder()


def _user_cache_folder() -> Path:
    return Path(os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser()) / "numba"


def _can_write(folder: Path) -> bool:
    """Whether a folder can be written; it is made where it is missing, as numba makes it."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(folder, os.W_OK | os.X_OK)


def _private_folder() -> Path:
    """A folder of this user alone, the same for every process; a new one where somebody else took the name.

    What lies in it is loaded as code.
    """
    owner = os.getuid() if hasattr(os, "getuid") else 0
    folder = Path(tempfile.gettempdir()) / f"tts2face-kernels-{owner}"
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        status = folder.lstat()
    except OSError:
        return Path(tempfile.mkdtemp(prefix="tts2face-kernels-"))
    is_private = stat.S_ISDIR(status.st_mode) and not status.st_mode & 0o077
    if hasattr(os, "getuid") and (status.st_uid != owner or not is_private):
        return Path(tempfile.mkdtemp(prefix="tts2face-kernels-"))
    return folder


_FOLDER = cache_folder(Path(__file__).parent)
if _FOLDER is not None:
    numba.config.CACHE_DIR = str(_FOLDER)
