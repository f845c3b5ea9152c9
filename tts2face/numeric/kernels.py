"""Decorators that compile kernels with numba, and the cache of compiled code.

All kernels of the package use these decorators; numba is imported in this module only. Compiled code is kept in the
user's cache folder, by the content of the module and of what it takes from others: installations of the same code share
it, and a changed module is never used with the code of an earlier one. If the folder cannot be written, a private
temporary folder takes its place.

Compilation delays a first run by up to half a minute; it is logged at the level INFO.

Switch for ONNX Runtime's telemetry, which would send data and write to the user's home folder.
"""

import gc
import hashlib
import importlib
import inspect
import logging
import os
import shutil
import stat
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import numba
import numpy as np
from numba.core import entrypoints, event, typed_passes, untyped_passes
from numba.core.caching import CompileResultCacheImpl, FunctionCache, _CacheLocator
from numba.core.compiler import CompilerBase
from numba.core.compiler_machinery import PassManager
from numba.core.dispatcher import Dispatcher
from numba.core.runtime import rtsys

from tts2face.storage.files import user_cache

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")
LOG = logging.getLogger(__name__)
REPORT_S = 5.0  # between two messages of a compilation
CACHE_VARIABLE = "NUMBA_CACHE_DIR"  # set by the user
N_VERSIONS = 4  # of the compiled kernels of a module that are kept
# Extensions of other packages are not loaded: no kernel uses their types, and looking for them takes 20 ms of a start.
entrypoints._already_initialized = True


class ModuleLocator(_CacheLocator):  # type: ignore[misc]
    """Folder of the compiled kernels of a module: its name and a hash of all that its kernels are compiled of."""

    def __init__(self, function: Callable[..., Any], path: str) -> None:
        self._function, self._py_file = function, path
        self._stamp = _stamp(path, function.__globals__)

    @classmethod
    def from_function(cls, function: Callable[..., Any], path: str) -> "ModuleLocator":
        """As numba asks for a locator."""
        return cls(function, path)

    def get_cache_path(self) -> str:
        """Folder of the compiled code."""
        return str(FOLDER / f"{Path(self._py_file).stem}-{self._stamp}")

    def get_source_stamp(self) -> str:
        """By which numba knows that compiled code is valid."""
        return self._stamp

    def get_disambiguator(self) -> str:
        """Line of the function, as several of a module may have one name."""
        return str(self._function.__code__.co_firstlineno)

    def ensure_cache_path(self) -> None:
        """Create the folder before code is saved, and remove those of the oldest versions of the module."""
        super().ensure_cache_path()
        versions = sorted(FOLDER.glob(f"{Path(self._py_file).stem}-*"), key=_time_of_change)
        for folder in versions[:-N_VERSIONS]:
            shutil.rmtree(folder, ignore_errors=True)


def _time_of_change(path: Path) -> float:
    try:
        return path.stat().st_mtime
    except OSError:  # another process has removed it
        return 0.0


_stamps: dict[str, str] = {}  # by the path of the module


def _stamp(path: str, names: dict[str, Any]) -> str:
    """Hash of a module's name and text, of the modules of the kernels that it imports, and of imported constants.

    numba looks at the text of the module alone, keeps code that calls kernels of another module as it was, and finds a
    kernel's module by its name.
    """
    if path not in _stamps:
        found = hashlib.sha256(names["__name__"].encode() + Path(path).read_bytes())
        for name, value in sorted(names.items()):
            if isinstance(value, Dispatcher):
                other = inspect.getfile(value.py_func)
                found.update(_stamp(other, value.py_func.__globals__).encode() if other != path else b"")
            elif isinstance(value, np.ndarray):
                found.update(name.encode() + value.tobytes())
            elif isinstance(value, bool | int | float | str | tuple) and not name.startswith("__"):
                found.update(f"{name}={value!r};".encode())
        _stamps[path] = found.hexdigest()[:16]
    return _stamps[path]


class KernelCacheImpl(CompileResultCacheImpl):  # type: ignore[misc]
    """What numba keeps of a kernel, in the folder of its module."""

    _locator_classes = [ModuleLocator]  # noqa: RUF012 - as numba declares it


class KernelCache(FunctionCache):  # type: ignore[misc]
    """Compiled code of a kernel on disk, which is loaded without the compiler.

    numba's own class first registers all that its compiler can compile, which takes most of the time of the first
    kernel of a process. Compiled code needs its run time only, and the compiler registers everything itself.
    """

    _impl_class = KernelCacheImpl

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Compiled code for a signature; None if it is not in the cache."""
        rtsys.initialize(target_context)
        with self._guard_against_spurious_io_errors():
            return self._load_overload(sig, target_context)


class KernelCompiler(CompilerBase):  # type: ignore[misc]
    """numba's compiler without the passes that change nothing in a kernel.

    Those are for closures, exceptions, expressions over whole arrays, and literal arguments. After each pass numba
    analyses the function again, which takes a tenth of the time of compiling it.
    """

    PASSES = (
        untyped_passes.TranslateByteCode,
        untyped_passes.FixupArgs,
        untyped_passes.IRProcessing,
        untyped_passes.GenericRewrites,
        untyped_passes.InlineInlinables,
        untyped_passes.ReconstructSSA,
        typed_passes.NopythonTypeInference,
        typed_passes.PreLowerStripPhis,
        typed_passes.IRLegalization,
        typed_passes.NativeLowering,
        typed_passes.NoPythonBackend,
    )

    def define_pipelines(self) -> list[Any]:
        """As numba asks for the passes."""
        passes = PassManager("kernel")
        for one in self.PASSES:
            passes.add_pass(one, one.__name__)
        passes.finalize()
        return [passes]


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
    compiled: Any = numba.njit(
        nogil=True,
        error_model="numpy",
        fastmath=fastmath,
        no_cfunc_wrapper=True,  # nobody calls a kernel from C
        pipeline_class=KernelCompiler,
    )(function)
    compiled._cache = KernelCache(function)
    found: Callable[Arguments, Result] = compiled
    return found


def cache_folder() -> Path:
    """Folder for compiled kernels: that of the user's choice, that of the user's cache, or a private temporary one."""
    if chosen := os.environ.get(CACHE_VARIABLE):
        return Path(chosen)
    folder = user_cache() / "kernels"
    return folder if _can_write(folder) else _private_folder()


def _can_write(folder: Path) -> bool:
    """Whether a folder is writable; a missing folder is created."""
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


FOLDER = cache_folder()


class _Compilations(event.Listener):  # type: ignore[misc]
    """Logs that functions are compiled: the first one, and now and then how many there have been.

    Meanwhile no garbage is looked for: a compilation makes 100,000 of objects that live as long as it, and looking
    through them takes a tenth of its time. numba lets one thread compile at a time.
    """

    def __init__(self) -> None:
        self.n_functions, self._next_s = 0, 0.0
        self._depth, self._collects = 0, False

    def on_start(self, event: Any) -> None:
        """Count the function whose compilation begins; functions from the disk cache never come here."""
        self.n_functions += 1
        if self._depth == 0:
            self._collects = gc.isenabled()
            gc.disable()
        self._depth += 1
        if time.monotonic() >= self._next_s:
            so_far = "" if self.n_functions == 1 else f": {self.n_functions} functions so far"
            LOG.info(
                "compiling kernels, once on this machine%s", so_far, extra={"fields": {"functions": self.n_functions}}
            )
            self._next_s = time.monotonic() + REPORT_S

    def on_end(self, event: Any) -> None:
        """Collect garbage again after the outermost function."""
        self._depth -= 1
        if self._depth == 0 and self._collects:
            gc.enable()


COMPILATIONS = _Compilations()
event.register("numba:compile", COMPILATIONS)


VARIABLE = "ORT_DISABLE_TELEMETRY"  # read when the native library is loaded


def disable_telemetry() -> None:
    """Switch ONNX Runtime's telemetry off; call this before every import of the library.

    By default, ONNX Runtime writes a device id and an event database under ``~/.cache/Microsoft`` and uploads events.
    The environment variable acts if the library is not loaded yet, the library's own function if it is. Without ONNX
    Runtime the call has no effect.
    """
    os.environ[VARIABLE] = "1"
    try:
        runtime = importlib.import_module("onnxruntime")
    except ImportError:
        return
    disable = getattr(runtime, "disable_telemetry_events", None)  # missing in some builds
    if disable is not None:
        disable()
