"""Decorators that compile kernels with numba, and the choice of the cache folder for compiled code.

All kernels of the package use these decorators; numba is imported in this module only. If neither the package's folder
nor the user's cache folder is writable, compiled code is cached in a private temporary folder.
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
CACHE_VARIABLE = "NUMBA_CACHE_DIR"  # set by the user; numba reads it itself


def kernel(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """Compile a function at its first call, cache the code on disk, and release the GIL while it runs."""
    compiled: Callable[Arguments, Result] = numba.njit(cache=True, nogil=True, error_model="numpy")(function)
    return compiled


def vectorized_kernel(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """Compile a kernel with `fastmath`, which vectorises loops over long arrays by reordering sums.

    Such a kernel calls only inlined ones: which others the compiler inlines depends on what is in the cache, and with
    `fastmath` the result would, too.
    """
    compiled: Callable[Arguments, Result] = numba.njit(cache=True, nogil=True, error_model="numpy", fastmath=True)(
        function
    )
    return compiled


def inlined_kernel(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """Compile a function inline in each kernel that calls it."""
    compiled: Callable[Arguments, Result] = numba.njit(inline="always", error_model="numpy")(function)
    return compiled


def cache_folder(package: Path) -> Path | None:
    """Private cache folder for compiled kernels; None if numba's own choice is writable."""
    if CACHE_VARIABLE in os.environ or _can_write(package / "__pycache__") or _can_write(_user_cache_folder()):
        return None
    return _private_folder()


def _user_cache_folder() -> Path:
    return Path(os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser()) / "numba"


def _can_write(folder: Path) -> bool:
    """Whether a folder is writable; a missing folder is created, as numba does."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(folder, os.W_OK | os.X_OK)


def _private_folder() -> Path:
    """Temporary folder that only this user can write; a new one if another user owns the usual name.

    The folder must be private because its files are loaded as code.
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
