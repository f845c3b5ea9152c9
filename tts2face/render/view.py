"""A window in which a clip's head plays in real time; the mouse turns it, space starts it again, q closes it."""

import os
import sys
import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import BackendError
from tts2face.face.model import Face
from tts2face.render.bake import exposed
from tts2face.render.camera import Optics, optics
from tts2face.render.draw import available_cores
from tts2face.render.light import lamps, light_table
from tts2face.render.picture import Picture, background_kind
from tts2face.render.surface import surfaced
from tts2face.render.vtk import ON_SCREEN, Puppet, aim, probe, require_pyvista, windows_of
from tts2face.types import Clip

WALL, WALL_TOP = "#3a4049", "#7d8793"  # behind the head, unless the picture names a colour
TICK_MS = 10  # between looks at the clock


def view(clip: Clip, face: Face, picture: Picture) -> None:
    """Play a clip's head in a window, without sound, until the window is closed.

    Raises
    ------
    BackendError
        pyvista is not installed, or there is no display or no GL for it.
    """
    require_display()
    player = Player(clip, face, picture)
    try:
        player.run()
    finally:
        player.close()


def require_display() -> None:
    """Make sure that a window can be opened here.

    Raises
    ------
    BackendError
        It cannot.
    """
    require_pyvista("--view")
    is_linux = sys.platform.startswith("linux")
    if is_linux and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise BackendError("--view opens a window, and this machine has no display; write a file with --out clip.mp4")
    if not probe(ON_SCREEN):
        raise BackendError(
            "VTK cannot open a window on this display (it needs X11 or XWayland, and OpenGL 3.2); "
            "write a file with --out clip.mp4"
        )


def camera_matrix(camera: Any) -> NDArray[np.float64]:
    """(3, 4) view of a pyvista camera as `tts2face.render.camera.Optics` has it: x right, y down, z ahead."""
    matrix = camera.GetModelViewTransformMatrix()
    rows = np.array([[matrix.GetElement(row, column) for column in range(4)] for row in range(3)])
    return rows * [[1.0], [-1.0], [-1.0]]


class Player:
    """The window, the head in it and the clock that moves both."""

    def __init__(self, clip: Clip, face: Face, picture: Picture) -> None:
        import pyvista

        self._clip, self._surface, self._towards = clip, surfaced(face), lamps(picture.view)
        self._exposure = exposed(face, self._surface, self._towards, available_cores())
        self._optics = optics(picture.view, face, (picture.width, picture.height))
        with windows_of(ON_SCREEN):
            self.plotter: Any = pyvista.Plotter(
                window_size=[picture.width, picture.height], lighting="none", title="tts2face"
            )
        self._paint_wall(picture)
        self._puppet = Puppet(self._surface, self.plotter)
        aim(self.plotter, self._optics, picture.height)
        self.plotter.add_key_event("space", self.restart)
        self._shown: tuple[int, int] | None = None
        self.restart()

    def run(self) -> None:
        """Play until the window is closed; the last picture stays."""
        self.plotter.add_timer_event(max_steps=2**31 - 1, duration=TICK_MS, callback=self._tick)
        self.restart()
        self.plotter.show(auto_close=False)

    def restart(self) -> None:
        """Begin with the first frame again."""
        self._began = time.perf_counter()
        self.show_at(0.0)

    def show_at(self, seconds: float) -> bool:
        """Move the head to a moment of the clip, lit for where the camera is now; False where nothing has changed."""
        frame = min(int(seconds * self._clip.fps), len(self._clip.motion) - 1)
        now = frame, int(self.plotter.camera.GetMTime())
        if now == self._shown:
            return False
        self._shown = now
        weights = self._clip.motion.values[frame]
        view = camera_matrix(self.plotter.camera)
        lights = light_table(self._towards, Optics(view, self._optics.lens))
        points = self._surface.rig.posed(weights, self._clip.head.values[frame])
        self._puppet.show(points, view, (lights, self._exposure.at(weights)))
        return True

    def close(self) -> None:
        """Close the window."""
        self.plotter.close()

    def _tick(self, _step: int) -> None:
        if self.show_at(time.perf_counter() - self._began):
            self.plotter.render()

    def _paint_wall(self, picture: Picture) -> None:
        self.plotter.enable_anti_aliasing("msaa", multi_samples=4)
        kind = background_kind(picture.background)
        if isinstance(kind, tuple):
            self.plotter.set_background(tuple(value / 255 for value in kind))
        else:
            self.plotter.set_background(WALL, top=WALL_TOP)
