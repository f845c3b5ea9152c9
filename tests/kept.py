"""What fixtures make in many seconds is kept on disk, by the content of the code and the files that it depends on.

The folder is that of TTS2FACE_TEST_CACHE, or one in the user's cache; it may be deleted at any time.
"""

import fcntl
import functools
import hashlib
import os
import pickle
import platform
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path
from types import FunctionType
from typing import Any, TypeVar

from tests.api.test_import_graph import ROOT, imports, modules
from tts2face.storage.user_folders import user_cache

Value = TypeVar("Value")
COMPUTES = ("numpy", "scipy", "numba", "av", "onnxruntime", "hibari-tts", "espeakng-loader", "hama", "soxr")
UNUSED_S = 30 * 86_400.0  # after which an entry is removed


def kept(make: Callable[[], Value]) -> Value:
    """Value of a function of a module of the tests; it is made where no earlier run has made the same."""
    entry = _folder() / f"{make.__name__}-{_digest(make)}.pickle"
    with _locked(entry):
        if not entry.is_file():
            partial = entry.with_suffix(".partial")
            with partial.open("wb") as file:
                _ResultPickler(file).dump(make())
            partial.replace(entry)
        found: Value = pickle.loads(entry.read_bytes())
    return found


class _ResultPickler(pickle.Pickler):
    """Leaves out functions without a name, by which a result was measured: a result is read only."""

    def reducer_override(self, value: Any) -> Any:
        return (_no_function, ()) if isinstance(value, FunctionType) and "<" in value.__qualname__ else NotImplemented


def _no_function() -> None:
    """What stands for a function that was left out."""


def _folder() -> Path:
    given = os.environ.get("TTS2FACE_TEST_CACHE")
    folder = Path(given) if given else user_cache() / "tests"
    folder.mkdir(parents=True, exist_ok=True)
    return folder


@contextmanager
def _locked(entry: Path) -> Iterator[None]:
    """The right to make an entry, which a process that ends gives back; entries that nobody uses are removed."""
    with entry.with_name(f"{entry.name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield
        os.utime(entry)
        for other in entry.parent.iterdir():
            if time.time() - other.stat().st_mtime > UNUSED_S:
                other.unlink()


@functools.cache
def _sources() -> dict[str, Path]:
    tests = (path for path in sorted((ROOT / "tests").rglob("*.py")))
    return modules() | {".".join(path.relative_to(ROOT).with_suffix("").parts): path for path in tests}


def _digest(make: Callable[..., object]) -> str:
    """Hash of a function's module and of those that it imports, of the shipped files, the libraries and the machine."""
    sources, found = _sources(), {make.__module__}
    waiting = [make.__module__]
    while waiting:
        new = imports(sources[waiting.pop()], sources) - found
        found |= new
        waiting += new
    digest = hashlib.sha256(f"{platform.machine()} {os.environ.get('OPENBLAS_CORETYPE')}".encode())
    for name in COMPUTES:
        digest.update(f"{name} {version(name)} ".encode())
    for path in (*(sources[name] for name in sorted(found)), *sorted((ROOT / "tts2face" / "data").iterdir())):
        digest.update(path.name.encode() + path.read_bytes())
    return digest.hexdigest()[:32]
