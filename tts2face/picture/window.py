"""Window that plays a clip in real time: the mouse turns the camera, space restarts, q closes.

It shows the pictures of `tts2face.picture.renderer` for its camera, so that a face has the light that it has in files.
"""

import math
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.models.face import Face
from tts2face.models.light import Photographed
from tts2face.picture.camera import CameraMatrices
from tts2face.picture.display import require_display, use_window_class
from tts2face.picture.options import SIDE_LIMITS_PX, STUDIO, Picture
from tts2face.picture.renderer import MeshRenderer, mesh_renderer
from tts2face.types import HEAD_CHANNELS, Clip

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
    if isinstance(face.light, Photographed):
        raise InputError("--view shows heads; write a file of a photograph with --out clip.mp4")
    require_display("--view")
    player = ClipPlayer(clip, face, picture)
    try:
        player.run()
    finally:
        player.close()


def aim_camera(camera: Any, optics: CameraMatrices, height: int) -> None:
    """Set a camera of pyvista from camera matrices for pictures of `height` samples."""
    view = optics.view
    place = -view[:, :3].T @ view[:, 3]
    camera.position = tuple(place)
    camera.focal_point = tuple(place + max(float(view[2, 3]), 1.0) * view[2, :3])  # at the depth of the origin
    camera.up = tuple(-view[1, :3])
    camera.view_angle = math.degrees(2 * math.atan(height / 2 / float(optics.lens[0])))


def camera_matrix(camera: Any) -> NDArray[np.float64]:
    """View (3, 4) of a pyvista camera in the axes of `tts2face.picture.camera.CameraMatrices`."""
    matrix = camera.GetModelViewTransformMatrix()
    rows = np.array([[matrix.GetElement(row, column) for column in range(4)] for row in range(3)])
    return rows * [[1.0], [-1.0], [-1.0]]


class HeadWindow(ABC):
    """Base of the windows that show a head; `tick` supplies the motion."""

    def __init__(self, face: Face, picture: Picture) -> None:
        import pyvista
        from vtkmodules.vtkRenderingCore import vtkActor2D, vtkImageMapper

        self._face = face
        self._picture = replace(picture, background=STUDIO) if picture.is_transparent else picture
        self._renderer = mesh_renderer(face, self._picture)
        with use_window_class():
            self.plotter: Any = pyvista.Plotter(
                window_size=[picture.width, picture.height], lighting="none", title="tts2face"
            )
        self._mapper: Any = vtkImageMapper()
        self._mapper.SetColorWindow(255.0)  # 8-bit levels as they are
        self._mapper.SetColorLevel(127.5)
        wall = vtkActor2D()
        wall.SetMapper(self._mapper)
        self.plotter.add_actor(wall, reset_camera=False)
        optics = self._renderer.scene.optics
        aim_camera(self.plotter.camera, optics, self._renderer.picture.samples[1])

    def run(self) -> None:
        """Call `tick` at every timer interval until the window is closed."""
        self.plotter.add_timer_event(max_steps=2**31 - 1, duration=TICK_MS, callback=self._tick)
        self.plotter.show(auto_close=False)

    @abstractmethod
    def tick(self) -> bool:
        """Pose the head for the present instant; returns whether the picture changed."""

    def pose(self, weights: NDArray[np.floating], head: NDArray[np.floating]) -> None:
        """Show the head with shape weights (K,) and head pose (6,), as the present camera sees it."""
        import pyvista

        pixels = self._seen().draw(weights, head)
        height, width, channels = pixels.shape
        image = pyvista.ImageData(dimensions=(width, height, 1))
        image.point_data["picture"] = pixels[::-1].reshape(-1, channels)  # VTK's first row is the lowest
        self._mapper.SetInputData(image)

    def close(self) -> None:
        """Close the window."""
        self.plotter.close()

    def _seen(self) -> MeshRenderer:
        """Renderer of pictures in the window's present size from its present camera."""
        least, most = SIDE_LIMITS_PX
        width, height = (min(max(side - side % 2, least), most) for side in self.plotter.window_size)
        if (width, height) != (self._picture.width, self._picture.height):
            self._picture = replace(self._picture, size=f"{width}x{height}")
            self._renderer = mesh_renderer(self._face, self._picture)
        lens = self._renderer.scene.optics.lens
        return self._renderer.seen_by(CameraMatrices(camera_matrix(self.plotter.camera), lens))

    def _tick(self, _step: int) -> None:
        if self.tick():
            self.plotter.render()


class ClipPlayer(HeadWindow):
    """Window that plays a clip by the wall clock."""

    def __init__(self, clip: Clip, face: Face, picture: Picture) -> None:
        super().__init__(face, picture)
        n_missing = len(face.shape_names) - len(clip.motion.channels)
        self._weights = np.pad(clip.motion.values, ((0, 0), (0, n_missing)))
        self._clip = clip
        self.plotter.add_key_event("space", self.restart)
        self._last_state: tuple[int, ...] | None = None
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
        state = frame, int(self.plotter.camera.GetMTime()), *self.plotter.window_size
        if state == self._last_state:
            return False
        self._last_state = state
        self.pose(self._weights[frame], self._clip.head.values[frame])
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
