"""Display for windows: VTK ends the process when it finds none, so a child process opens a window on it first."""

import os
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from types import MappingProxyType

import numpy as np

from lexicon.errors import BackendError
from tts2face.processes.child import Call, Handler
from tts2face.processes.parent import Child
from tts2face.processes.program import Program

WINDOW_CLASS = "vtkXOpenGLRenderWindow"
OFF_SCREEN_CLASSES = ("vtkEGLRenderWindow", "vtkOSOpenGLRenderWindow")  # VTK's fallbacks without a display
PROBE_TIMEOUT_S = 60.0
PROBE = "probe"  # name of the call
PROBE_PROGRAM = Program(f"{__name__}:HANDLERS")


def require_display(purpose: str, instead: str = "write a file with --out clip.mp4") -> None:
    """Check that a window can be opened on this machine.

    Raises
    ------
    BackendError
        pyvista is not installed, there is no display, or VTK cannot open a window on it; the message begins with
        `purpose`, and ends with what to do instead.
    """
    from importlib.util import find_spec

    if find_spec("pyvista") is None:
        raise BackendError(f"{purpose} needs pyvista, which is not installed; run: pip install 'tts2face[view]'")
    is_linux = sys.platform.startswith("linux")
    # VTK 9.7 ends the process where it finds no display (decision 223)
    if is_linux and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise BackendError(f"{purpose} opens a window, and this machine has no display; {instead}")
    if not can_open_window():
        raise BackendError(
            f"VTK cannot open a window on this display (it needs X11 or XWayland, and OpenGL 3.2); {instead}"
        )


@cache
def can_open_window() -> bool:
    """Whether VTK can draw in a window, tried once in a child process that may crash."""
    child = Child(PROBE_PROGRAM)
    try:
        return bool(child.call(PROBE, {}, timeout_s=PROBE_TIMEOUT_S).content["is_drawn"])
    except BackendError:
        return False
    finally:
        child.close()


def _probe(_call: Call) -> dict[str, bool]:
    """Whether a ball that is drawn in a window is seen in it."""
    os.environ.update(window_environment())
    import pyvista

    plotter = pyvista.Plotter(window_size=(32, 32))
    plotter.add_mesh(pyvista.Sphere(), color="red", lighting=False)
    plotter.show(auto_close=False, interactive=False)
    seen = np.asarray(plotter.screenshot(return_img=True))
    is_on_screen = plotter.render_window.GetClassName() not in OFF_SCREEN_CLASSES
    return {"is_drawn": int(seen[16, 16, 0]) > 200 and is_on_screen}


HANDLERS: Mapping[str, Handler] = MappingProxyType({PROBE: _probe})


def window_environment() -> dict[str, str]:
    """Environment variables that select VTK's window class; empty on other systems than Linux, which have one class."""
    return {"VTK_DEFAULT_OPENGL_WINDOW": WINDOW_CLASS} if sys.platform.startswith("linux") else {}


@contextmanager
def use_window_class() -> Iterator[None]:
    """Select VTK's window class within this context."""
    choice = window_environment()
    before = {name: os.environ.get(name) for name in choice}
    os.environ.update(choice)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
