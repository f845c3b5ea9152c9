"""Window that plays a clip in real time: the mouse turns the camera, space restarts, q closes."""

import os
import sys
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import BackendError, InputError
from tts2face.models.face import Face
from tts2face.numeric.reuse import available_cores
from tts2face.picture.camera import CameraMatrices, camera_matrices
from tts2face.picture.kernels.tables import lamp_directions, light_table
from tts2face.picture.light import compute_exposure
from tts2face.picture.options import Picture, parse_background
from tts2face.picture.surface import build_surface
from tts2face.picture.vtk_renderer import (
    ON_SCREEN,
    PlottedFace,
    aim_camera,
    can_draw_with,
    require_pyvista,
    use_window_class,
)
from tts2face.types import HEAD_CHANNELS, Clip

WALL, WALL_TOP = "#3a4049", "#7d8793"  # gradient of the background unless the picture has a colour
TICK_MS = 10  # interval of the timer


def show_clip(clip: Clip, face: Face, picture: Picture) -> None:
    """Play a clip in a window, without sound, until the window is closed.

    Raises
    ------
    InputError
        The face is that of a photograph.
    BackendError
        pyvista is not installed, or there is no display or no GL for it.
    """
    if face.photograph is not None:
        raise InputError("--view shows heads; write a file of a photograph with --out clip.mp4")
    require_display("--view")
    player = ClipPlayer(clip, face, picture)
    try:
        player.run()
    finally:
        player.close()


def require_display(purpose: str) -> None:
    """Check that a window can be opened on this machine.

    Raises
    ------
    BackendError
        There is no display, or VTK cannot open a window on it; the message begins with `purpose`.
    """
    require_pyvista(purpose)
    is_linux = sys.platform.startswith("linux")
    if is_linux and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise BackendError(
            f"{purpose} opens a window, and this machine has no display; write a file with --out clip.mp4"
        )
    if not can_draw_with(ON_SCREEN):
        raise BackendError(
            "VTK cannot open a window on this display (it needs X11 or XWayland, and OpenGL 3.2); "
            "write a file with --out clip.mp4"
        )


def camera_matrix(camera: Any) -> NDArray[np.float64]:
    """View (3, 4) of a pyvista camera in the axes of `tts2face.picture.camera.CameraMatrices`."""
    matrix = camera.GetModelViewTransformMatrix()
    rows = np.array([[matrix.GetElement(row, column) for column in range(4)] for row in range(3)])
    return rows * [[1.0], [-1.0], [-1.0]]


class HeadWindow(ABC):
    """Base of the windows that show a head; `tick` supplies the motion."""

    def __init__(self, face: Face, picture: Picture) -> None:
        import pyvista

        self._surface, self._lamps = build_surface(face), lamp_directions(picture.view)
        self._exposure = compute_exposure(face, self._surface, self._lamps, available_cores())
        self._optics = camera_matrices(picture.view, face, (picture.width, picture.height))
        with use_window_class(ON_SCREEN):
            self.plotter: Any = pyvista.Plotter(
                window_size=[picture.width, picture.height], lighting="none", title="tts2face"
            )
        self._paint_wall(picture)
        self._head = PlottedFace(self._surface, self.plotter)
        aim_camera(self.plotter, self._optics, picture.height)

    def run(self) -> None:
        """Call `tick` at every timer interval until the window is closed."""
        self.plotter.add_timer_event(max_steps=2**31 - 1, duration=TICK_MS, callback=self._tick)
        self.plotter.show(auto_close=False)

    @abstractmethod
    def tick(self) -> bool:
        """Pose the head for the present instant; returns whether the picture changed."""

    def pose(self, weights: NDArray[np.floating], head: NDArray[np.floating]) -> None:
        """Pose the head by shape weights (K,) and head pose (6,), lit for the present camera."""
        view = camera_matrix(self.plotter.camera)
        lights = light_table(self._lamps, CameraMatrices(view, self._optics.lens))
        self._head.show(self._surface.rig.pose(weights, head), view, (lights, self._exposure.at(weights)))

    def close(self) -> None:
        """Close the window."""
        self.plotter.close()

    def _tick(self, _step: int) -> None:
        if self.tick():
            self.plotter.render()

    def _paint_wall(self, picture: Picture) -> None:
        self.plotter.enable_anti_aliasing("msaa", multi_samples=4)
        kind = parse_background(picture.background)
        if isinstance(kind, tuple):
            self.plotter.set_background(tuple(value / 255 for value in kind))
        else:
            self.plotter.set_background(WALL, top=WALL_TOP)


class ClipPlayer(HeadWindow):
    """Window that plays a clip by the wall clock."""

    def __init__(self, clip: Clip, face: Face, picture: Picture) -> None:
        super().__init__(face, picture)
        self._clip = clip
        self.plotter.add_key_event("space", self.restart)
        self._last_state: tuple[int, int] | None = None
        self.restart()

    def run(self) -> None:
        """Play until the window is closed; the last frame remains at the end."""
        self.restart()
        super().run()

    def restart(self) -> None:
        """Play again from the first frame."""
        self._started = time.perf_counter()
        self.show_at(0.0)

    def tick(self) -> bool:
        """Show the frame of the present instant; returns whether the picture changed."""
        return self.show_at(time.perf_counter() - self._started)

    def show_at(self, seconds: float) -> bool:
        """Show the frame at an instant of the clip in seconds; returns whether the picture changed."""
        frame = min(int(seconds * self._clip.fps), len(self._clip.motion) - 1)
        state = frame, int(self.plotter.camera.GetMTime())
        if state == self._last_state:
            return False
        self._last_state = state
        self.pose(self._clip.motion.values[frame], self._clip.head.values[frame])
        return True


class LiveWindow(HeadWindow):
    """Window that shows captured motion as it arrives.

    Parameters
    ----------
    newest
        Returns the newest shape weights (K,) and head pose (6,), or None if there are no new ones.
    """

    def __init__(
        self, face: Face, picture: Picture, newest: Callable[[], tuple[NDArray[Any], NDArray[Any]] | None]
    ) -> None:
        super().__init__(face, picture)
        self._newest = newest
        self.pose(np.zeros(len(face.shape_names), np.float32), np.zeros(len(HEAD_CHANNELS), np.float32))

    def tick(self) -> bool:
        """Show the newest motion; returns whether there was any."""
        motion = self._newest()
        if motion is not None:
            self.pose(*motion)
        return motion is not None
