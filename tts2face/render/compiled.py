"""How the kernels of this room are compiled, and whether that has been done before."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from numba import njit

Kernel = TypeVar("Kernel", bound=Callable[..., Any])


def kernel(function: Kernel) -> Kernel:
    """A function compiled at its first call and kept on disk; it runs without the interpreter's lock."""
    compiled: Kernel = njit(cache=True, nogil=True, error_model="numpy")(function)
    return compiled


def streaming(function: Kernel) -> Kernel:
    """A kernel of plain loops over long arrays, compiled for the vector unit: sums may be reordered."""
    compiled: Kernel = njit(cache=True, nogil=True, error_model="numpy", fastmath=True)(function)
    return compiled


def inlined(function: Kernel) -> Kernel:
    """A piece of a kernel, compiled within each kernel that calls it."""
    compiled: Kernel = njit(inline="always", error_model="numpy")(function)
    return compiled


def kernels_are_compiled() -> bool:
    """Whether the drawing kernels lie compiled on disk; without them the first picture takes some seconds longer."""
    from tts2face.render import raster

    folder = Path(str(raster.draw_band.stats.cache_path))  # type: ignore[attr-defined]
    source = Path(raster.__file__).stat().st_mtime
    return any(index.stat().st_mtime >= source for index in folder.glob("raster.draw_band-*.nbi"))
