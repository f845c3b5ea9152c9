"""Decorators for kernels, which are compiled with numba, and the cache of compiled code.

All kernels of the package use these decorators. Compiled code is kept in the user's cache folder, by the content of the
module and of what it takes from others, the processor, and the compiler: installations of the same code share it, and a
changed module is never used with the code of an earlier one. If the folder cannot be written, a private temporary
folder takes its place. A process whose kernels are all in the cache imports neither numba nor LLVM.
"""

import ctypes
import hashlib
import importlib
import logging
import os
import platform
import shutil
import stat
import struct
import sys
import tempfile
import threading
import zlib
from collections.abc import Callable, Iterator, Sequence
from functools import cache, update_wrapper
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Generic, NamedTuple, ParamSpec, TypeVar

import numpy as np

from tts2face.numeric.object_code import load_object
from tts2face.storage.files import write_atomically
from tts2face.storage.user_folders import user_cache

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")
LOG = logging.getLogger(__name__)
CACHE_VARIABLE = "NUMBA_CACHE_DIR"  # set by the user
N_VERSIONS = 4  # of the compiled kernels of a module that are kept
# Numbers of kernels: a plain 1.0 makes a number of 64 bits of whatever it is multiplied with.
ZERO = np.float32(0)
HALF = np.float32(0.5)
UNIT = np.float32(1)
SUFFIX = ".kernel"  # of a file with the code of one kernel for one kind of arguments
ENTRY = "entry"  # the function of an object that is called
LAYOUT = 0x503  # flags of an array that matter: C and Fortran order, aligned, writable
SCALARS = {bool: -1, int: -2, float: -3}  # in the key of a call
CODES = {"O": ctypes.py_object, "?": ctypes.c_bool, "d": ctypes.c_double, "f": ctypes.c_float} | {
    code: getattr(ctypes, f"c_{sign}int{bits}")
    for codes, sign in (("bhiq", ""), ("BHIQ", "u"))
    for code, bits in zip(codes, (8, 16, 32, 64), strict=True)
}
BLOCK = 8  # entries that `write_larger` writes at once
_loading = threading.RLock()
_stamps: dict[str, str] = {}  # by the path of the module


class Intrinsic:
    """A function of `tts2face.numeric.compiler` for kernels, which writes instructions of LLVM itself."""

    def __init__(self, name: str) -> None:
        self.name = name

    def __call__(self, *_: Any) -> Any:
        """Only kernels can call it."""
        raise TypeError(f"{self.name} is called by compiled kernels only")


flat_view, write_larger = Intrinsic("flat_view"), Intrinsic("write_larger")


class Compiled(NamedTuple):
    """A kernel for one kind of arguments.

    Parameters
    ----------
    arguments
        Codes of the types of the arguments, in which tuples are replaced by what they hold: ``O`` is an array, others
        as in `ctypes`' ``_type_``.
    results
        Codes, as in `struct`, of the results, 8 bytes each.
    is_tuple
        Whether the results are a tuple.
    code
        Object file in which `ENTRY` has these arguments and, if there are results, their address. It returns 0 unless
        memory is short.
    """

    arguments: str
    results: str
    is_tuple: bool
    code: bytes


class Kernel(Generic[Arguments, Result]):
    """A function that is compiled at its first call with arguments of new types, and runs without the GIL.

    Arguments are arrays, numbers, and tuples of them, with names of their fields or without; results are numbers, a
    tuple of numbers, or None.
    """

    def __init__(
        self, function: Callable[Arguments, Result], *, is_inlined: bool = False, reorders_sums: bool = False
    ) -> None:
        update_wrapper(self, function)
        self.py_func, self.is_inlined, self.reorders_sums = function, is_inlined, reorders_sums
        self._calls: dict[tuple[Any, ...], tuple[Callable[..., int], str, bool]] = {}  # by what `_flatten` gives
        self._loaded: dict[tuple[int, ...], tuple[Callable[..., int], str, bool]] = {}  # by `_describe`
        self.n_from_cache = 0  # kinds of arguments whose code was in the cache

    def __call__(self, *arguments: Arguments.args, **options: Arguments.kwargs) -> Result:
        """Call the compiled code.

        Raises
        ------
        MemoryError
            The code could not allocate memory.
        """
        flat: list[Any] = []
        seen: list[Any] = []
        _flatten(arguments, flat, seen)
        key = tuple(seen)
        try:
            function, results, is_tuple = self._calls[key]
        except KeyError:
            function, results, is_tuple = self._calls[key] = self._load(arguments)
        if not results:
            if function(*flat):
                raise MemoryError(f"{self.py_func.__qualname__} lacks memory")
            return None  # type: ignore[return-value]
        found = ctypes.create_string_buffer(struct.calcsize(results))
        if function(*flat, found):
            raise MemoryError(f"{self.py_func.__qualname__} lacks memory")
        numbers: Any = struct.unpack(results, found)
        return numbers if is_tuple else numbers[0]  # type: ignore[no-any-return]

    def files(self) -> list[Path]:
        """Files with the compiled code of this version."""
        return list(self._folder().glob(f"{self._stem()}-*{SUFFIX}"))

    def _folder(self) -> Path:
        path = self.py_func.__code__.co_filename
        return FOLDER / f"{Path(path).stem}-{_stamp(path, self.py_func.__globals__)}"

    def _stem(self) -> str:
        return f"{self.py_func.__name__}-{self.py_func.__code__.co_firstlineno}"  # several may have one name

    def _load(self, arguments: Sequence[Any]) -> tuple[Callable[..., int], str, bool]:
        key = tuple(_describe(arguments))
        with _loading:
            if key in self._loaded:
                return self._loaded[key]
            kind = hashlib.sha256(f"{key} {_machine()}".encode()).hexdigest()[:16]
            path = self._folder() / f"{self._stem()}-{kind}{SUFFIX}"
            try:
                found = _read(path)
                self.n_from_cache += 1
            # not in the cache, or damaged: compiled again
            except (OSError, ValueError):
                found = importlib.import_module("tts2face.numeric.compiler").compile_kernel(self, tuple(arguments))
                _keep(path, found)
            types = [CODES[code] for code in found.arguments]
            prototype = ctypes.CFUNCTYPE(ctypes.c_int, *types, *([ctypes.c_char_p] if found.results else []))
            function = prototype(load_object(found.code, ENTRY))
            self._loaded[key] = function, found.results, found.is_tuple
            return self._loaded[key]


def _flatten(values: Sequence[Any], flat: list[Any], seen: list[Any]) -> None:
    """Append the arrays and numbers that arguments hold, and what distinguishes their types; made to be fast."""
    for value in values:
        kind = type(value)
        if kind is np.ndarray:
            flat.append(value)
            seen.append(value.flags.num << 8 | value.ndim)
            seen.append(value.dtype)
        elif kind in SCALARS:
            flat.append(value)
            seen.append(kind)
        elif isinstance(value, tuple):  # or a NamedTuple
            seen.append(-1 - len(value))
            _flatten(value, flat, seen)
        elif isinstance(value, np.ndarray | np.float32):
            _flatten((np.asarray(value),), flat, seen)
        elif isinstance(value, np.number | np.bool):
            flat.append(value.item())
            seen.append(kind)
        else:
            raise TypeError(f"a kernel takes arrays, numbers and tuples of them, not {kind.__name__}")


def _describe(values: Sequence[Any]) -> Iterator[int]:
    """Types on which code depends: those of arguments that `_flatten` takes, and the layout of arrays."""
    for value in values:
        if isinstance(value, np.ndarray):
            layout, dtype = value.flags.num & LAYOUT, value.dtype
            layout = layout & ~2 if layout & 1 else layout  # rows of one entry are in both orders
            yield layout | dtype.isnative << 2 | value.ndim << 12 | dtype.num << 20
        elif isinstance(value, np.number | np.bool) and type(value) not in SCALARS:
            is_same = value.dtype.itemsize == 8 and value.dtype.kind in "if"  # as Python's own
            yield SCALARS[type(value.item())] if is_same or value.dtype.kind == "b" else -4 - value.dtype.num
        elif isinstance(value, tuple):
            # below all codes of types
            yield -64 - len(value)
            yield from _describe(value)
        else:
            yield SCALARS[type(value)]


def _read(path: Path) -> Compiled:
    """Compiled code from a file of the cache; raises a ValueError if it is damaged."""
    stated, _, content = path.read_bytes().partition(b"\n")
    if stated != b"%d" % zlib.crc32(content):
        raise ValueError(path)
    arguments, results, is_tuple, code = content.split(b"\n", 3)
    return Compiled(arguments.decode(), results.decode(), bool(is_tuple), code)


def _keep(path: Path, found: Compiled) -> None:
    """Write a file of the cache if that is possible, and remove the folders of the oldest versions of its module."""
    content = b"\n".join([found.arguments.encode(), found.results.encode(), b"1" * found.is_tuple, found.code])
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(path, b"%d\n" % zlib.crc32(content) + content)
    except OSError:
        return
    versions = sorted(path.parent.parent.glob(f"{path.parent.name.rpartition('-')[0]}-*"), key=_time_of_change)
    for folder in versions[:-N_VERSIONS]:
        shutil.rmtree(folder, ignore_errors=True)


def _time_of_change(path: Path) -> float:
    try:
        return path.stat().st_mtime
    except OSError:  # another process has removed it
        return 0.0


@cache
def _machine() -> str:
    """Dependencies of compiled code besides its source: processor, compiler, and settings of the compiler."""
    compiler = Path(__file__).with_name("compiler.py").read_bytes()
    settings = sorted(item for item in os.environ.items() if item[0].startswith("NUMBA_") and item[0] != CACHE_VARIABLE)
    versions = []
    for package in ("numba", "llvmlite"):
        spec = find_spec(package)
        if spec is not None and spec.origin is not None:
            versions.append(Path(spec.origin).with_name("_version.py").read_bytes())
    return repr((_processor(), compiler, versions, settings, sys.version_info[:2], sys.platform, platform.machine()))


def _processor() -> object:
    """Name and features of the processor."""
    try:
        with Path("/proc/cpuinfo").open("rb") as file:
            first = file.read(8192).split(b"\n\n")[0]  # all cores have the same
        lines = [line for line in first.split(b"\n") if line.startswith((b"model", b"cpu family", b"flags"))]
    except OSError:
        lines = []
    if any(line.startswith(b"flags") for line in lines):
        return lines
    llvm = importlib.import_module("llvmlite.binding")
    llvm.initialize_native_target()
    return llvm.get_host_cpu_name(), sorted(llvm.get_host_cpu_features().items())


def _stamp(path: str, names: dict[str, Any]) -> str:
    """Hash of a module's name and text, of the modules of the kernels that it imports, and of imported constants."""
    if path not in _stamps:
        found = hashlib.sha256(names["__name__"].encode() + Path(path).read_bytes())
        for name, value in sorted(names.items()):
            if isinstance(value, Kernel):
                other = value.py_func.__code__.co_filename
                found.update(_stamp(other, value.py_func.__globals__).encode() if other != path else b"")
            elif isinstance(value, np.ndarray | np.float32):
                found.update(name.encode() + value.tobytes())
            elif isinstance(value, type) and issubclass(value, tuple):
                found.update(f"{name}={getattr(value, '_fields', ())!r};".encode())  # of a NamedTuple
            elif isinstance(value, bool | int | float | str | tuple) and not name.startswith("__"):
                found.update(f"{name}={value!r};".encode())
        _stamps[path] = found.hexdigest()[:16]
    return _stamps[path]


def kernel(function: Callable[Arguments, Result]) -> Kernel[Arguments, Result]:
    """Compile a function at its first call, cache the code on disk, and release the GIL while it runs."""
    return Kernel(function)


def vectorized_kernel(function: Callable[Arguments, Result]) -> Kernel[Arguments, Result]:
    """Compile a kernel with `fastmath`, which vectorises loops over long arrays by reordering sums.

    Such a kernel calls only inlined ones: which others the compiler inlines depends on what has been compiled before,
    and with `fastmath` the result would, too.
    """
    return Kernel(function, reorders_sums=True)


def inlined_kernel(function: Callable[Arguments, Result]) -> Kernel[Arguments, Result]:
    """Compile a function inline in each kernel that calls it."""
    return Kernel(function, is_inlined=True)


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
    # code in another user's folder could be exchanged before it is loaded
    if hasattr(os, "getuid") and (status.st_uid != owner or not is_private):
        return Path(tempfile.mkdtemp(prefix="tts2face-kernels-"))
    return folder


FOLDER = cache_folder()
