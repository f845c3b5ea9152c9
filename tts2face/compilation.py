"""Decorators that compile kernels with numba, and the choice of the cache folder for compiled code.

All kernels of the package use these decorators; numba is imported in this module only. If neither the package's folder
nor the user's cache folder is writable, compiled code is cached in a private temporary folder.

Compilation delays a first run by up to half a minute; it is logged at the level INFO.
"""

import logging
import os
import stat
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import numba
from numba.core import event
from numba.core.caching import FunctionCache
from numba.core.runtime import rtsys

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")
LOG = logging.getLogger(__name__)
REPORT_S = 5.0  # between two messages of a compilation
CACHE_VARIABLE = "NUMBA_CACHE_DIR"  # set by the user; numba reads it itself


class KernelCache(FunctionCache):  # type: ignore[misc]
    """Compiled code of a kernel on disk, which is loaded without the compiler.

    numba's own class first registers all that its compiler can compile, which takes most of the time of the first
    kernel of a process. Compiled code needs its run time only, and the compiler registers everything itself.
    """

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Compiled code for a signature; None if it is not in the cache."""
        rtsys.initialize(target_context)
        with self._guard_against_spurious_io_errors():
            return self._load_overload(sig, target_context)


def kernel(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """Compile a function at its first call, cache the code on disk, and release the GIL while it runs."""
    return _compiled(function, fastmath=False)


def vectorized_kernel(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """Compile a kernel with `fastmath`, which vectorises loops over long arrays by reordering sums.

    Such a kernel calls only inlined ones: which others the compiler inlines depends on what is in the cache, and with
    `fastmath` the result would, too.
    """
    return _compiled(function, fastmath=True)


def inlined_kernel(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """Compile a function inline in each kernel that calls it."""
    compiled: Callable[Arguments, Result] = numba.njit(inline="always", error_model="numpy")(function)
    return compiled


def _compiled(function: Callable[Arguments, Result], *, fastmath: bool) -> Callable[Arguments, Result]:
    compiled: Any = numba.njit(nogil=True, error_model="numpy", fastmath=fastmath)(function)
    compiled._cache = KernelCache(function)
    found: Callable[Arguments, Result] = compiled
    return found


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


class _Compilations(event.Listener):  # type: ignore[misc]
    """Logs that functions are compiled: the first one, and now and then how many there have been."""

    def __init__(self) -> None:
        self.n_functions, self._next_s = 0, 0.0

    def on_start(self, event: Any) -> None:
        """Count the function whose compilation begins; functions from the disk cache never come here."""
        self.n_functions += 1
        if time.monotonic() >= self._next_s:
            so_far = "" if self.n_functions == 1 else f": {self.n_functions} functions so far"
            LOG.info(
                "compiling kernels, once on this machine%s", so_far, extra={"fields": {"functions": self.n_functions}}
            )
            self._next_s = time.monotonic() + REPORT_S

    def on_end(self, event: Any) -> None:
        """Ignore the end of a compilation."""


COMPILATIONS = _Compilations()
event.register("numba:compile", COMPILATIONS)
