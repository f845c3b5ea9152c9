"""Import of hibari-tts with SciPy's Fourier transforms alone.

hibari-tts takes two functions of `scipy.fft`, whose import brings 200 modules: 0.15 s and 20 MB of each start. NumPy's
transforms of single precision, which hibari-tts has in their place, differ in the last bit.
"""

import sys
from collections.abc import Sequence
from importlib import import_module
from importlib.machinery import EXTENSION_SUFFIXES
from importlib.util import find_spec, module_from_spec, spec_from_file_location
from pathlib import Path
from threading import get_ident
from types import ModuleType
from typing import Any

PACKAGE = "scipy.fft"
CODES = ("_pocketfft/pypocketfft", "_duccfft/pyduccfft")  # until SciPy 1.17, and later
REFUSED = frozenset({"scipy", PACKAGE})
UNSCALED, BY_LENGTH = 0, 2  # of SciPy's compiled transforms


def import_hibari() -> ModuleType:
    """hibari-tts; without `scipy.fft` where its compiled code is found."""
    code = None if {"hibari", PACKAGE} & sys.modules.keys() else _compiled_transforms()
    if code is None:
        return import_module("hibari")
    missing = _Missing()
    sys.meta_path.insert(0, missing)
    try:
        hibari = import_module("hibari")
    finally:
        sys.meta_path.remove(missing)
    dsp: Any = import_module("hibari.dsp")
    # NumPy's transforms give other bits than SciPy's (decision 200)
    if dsp.FFT_BACKEND == "numpy":
        dsp.rfft = lambda values, axis: code.r2c(values, (axis,), True, UNSCALED, None, 1)
        dsp.irfft = lambda values, n, axis: code.c2r(values, (axis,), n, False, BY_LENGTH, None, 1)
    return hibari


class _Missing:
    """A finder that says to the thread that made it, and no other, that there is no SciPy."""

    def __init__(self) -> None:
        self._thread = get_ident()

    def find_spec(self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None) -> None:
        if name in REFUSED and get_ident() == self._thread:
            raise ImportError(f"{name} is not needed")


def _compiled_transforms() -> Any | None:
    """SciPy's compiled transforms; None if they lie elsewhere in another version."""
    found = find_spec("scipy")
    folders = [] if found is None else list(found.submodule_search_locations or ())
    names = [(folder, name, suffix) for folder in folders for name in CODES for suffix in EXTENSION_SUFFIXES]
    files = ((name, Path(folder, "fft", f"{name}{suffix}")) for folder, name, suffix in names)
    name, file = next((found for found in files if found[1].is_file()), ("", None))
    spec = None if file is None else spec_from_file_location(f"{PACKAGE}.{name.replace('/', '.')}", file)
    if spec is None or spec.loader is None:
        return None
    code = module_from_spec(spec)
    spec.loader.exec_module(code)
    return code if hasattr(code, "r2c") and hasattr(code, "c2r") else None
