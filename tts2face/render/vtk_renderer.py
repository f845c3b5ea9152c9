"""VTK renderer, off screen with a GPU or software GL; vertices are lit by `tts2face.render.shade`.

VTK ends the process when it finds no GL, so a child process probes it first.
"""

import math
import os
import sys
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import BackendError
from tts2face.compilation import kernel
from tts2face.processes.child import Call, Handler
from tts2face.processes.parent import Child
from tts2face.processes.program import Program
from tts2face.render.camera import CameraMatrices
from tts2face.render.fragment_rows import OPACITY
from tts2face.render.raster import HOLES
from tts2face.render.scene import Scene
from tts2face.render.surface import Surface
from tts2face.render.tone_tables import encoding_table, linear_table
from tts2face.render.vertices import VertexLight, brighten, build_vertex_light, triangle_shades

OFF_SCREEN, ON_SCREEN = "vtkEGLRenderWindow", "vtkXOpenGLRenderWindow"  # the first falls back to OSMesa automatically
OFF_SCREEN_CLASSES = ("vtkEGLRenderWindow", "vtkOSOpenGLRenderWindow")
PROBE_TIMEOUT_S = 60.0
PROBE, PROBE_PROGRAM = "probe", Program(f"{__name__}:HANDLERS")  # name of the call, and who answers it
HALF_COVERED = 128  # of 255: parts with holes are drawn from this coverage on
VTK_TONE_TABLES = (linear_table(), encoding_table(8192))


def require_gl() -> None:
    """Check that VTK can draw off screen on this machine.

    Raises
    ------
    BackendError
        pyvista is not installed, or there is neither a GPU nor software GL.
    """
    require_pyvista("--renderer pyvista")
    if not can_draw_with(OFF_SCREEN):
        raise BackendError(
            "VTK finds neither a GPU nor software GL on this machine; draw with --renderer numba, or install one "
            "(on Debian and Ubuntu: apt install libegl1 libgl1-mesa-dri)"
        )


def require_pyvista(purpose: str) -> None:
    """Check that pyvista is installed.

    Raises
    ------
    BackendError
        pyvista is not installed; the message begins with `purpose`.
    """
    from importlib.util import find_spec

    if find_spec("pyvista") is None:
        raise BackendError(f"{purpose} needs pyvista, which is not installed; run: pip install 'tts2face[view]'")


@cache
def can_draw_with(window: str) -> bool:
    """Whether VTK can draw in a window of the class `window`, tried once in a child process that may crash."""
    child = Child(PROBE_PROGRAM)
    try:
        return bool(child.call(PROBE, {"window": window}, timeout_s=PROBE_TIMEOUT_S).content["is_drawn"])
    except BackendError:
        return False
    finally:
        child.close()


def _probe(call: Call) -> dict[str, bool]:
    """Whether a ball that is drawn in a window of the class ``window`` is seen in it."""
    window = call.content["window"]
    is_off_screen = window == OFF_SCREEN
    os.environ.update(window_environment(window))
    import pyvista

    plotter = pyvista.Plotter(off_screen=is_off_screen, window_size=(32, 32))
    plotter.add_mesh(pyvista.Sphere(), color="red", lighting=False)
    plotter.show(auto_close=False, interactive=False)
    seen = np.asarray(plotter.screenshot(return_img=True))
    # Without a display VTK falls back to an off-screen window.
    is_asked_for = is_off_screen or plotter.render_window.GetClassName() not in OFF_SCREEN_CLASSES
    return {"is_drawn": int(seen[16, 16, 0]) > 200 and is_asked_for}


HANDLERS: Mapping[str, Handler] = MappingProxyType({PROBE: _probe})


def window_environment(window: str) -> dict[str, str]:
    """Environment variables that select VTK's window class; empty on other systems than Linux, which have one class."""
    return {"VTK_DEFAULT_OPENGL_WINDOW": window} if sys.platform.startswith("linux") else {}


@contextmanager
def use_window_class(window: str) -> Iterator[None]:
    """Select VTK's window class within this context."""
    choice = window_environment(window)
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


def render_frames(
    scene: Scene, poses: Iterable[tuple[NDArray[np.float32], NDArray[np.float32]]]
) -> Iterator[NDArray[np.uint8]]:
    """Pictures (H, W, 3 or 4) of a scene's face for pairs of weights (K,) and head poses (6,), in order.

    All are pixels in one window by the thread that requests the first.

    Raises
    ------
    BackendError
        As `require_gl`.
    """
    require_gl()
    picture = scene.picture
    side = picture.samples_per_side
    plotter = _plotter((picture.width * side, picture.height * side), scene)
    try:
        actors = PlottedFace(scene.surface, plotter)
        for weights, head in poses:
            points = scene.surface.rig.pose(weights, head)
            actors.show(points, scene.optics.view, (scene.lights, scene.exposure.at(weights)))
            plotter.renderer.ResetCameraClippingRange()
            plotter.render()
            samples = np.asarray(plotter.screenshot(None, transparent_background=True, return_img=True))
            pixels = np.zeros((picture.height, picture.width, picture.channels), np.uint8)
            pixels[:, :, :3] = scene.background
            average_samples(samples, side, VTK_TONE_TABLES, pixels)
            yield pixels
    finally:
        plotter.close()


@dataclass(frozen=True, slots=True, eq=False)
class PlottedMesh:
    """One mesh of a plotted face: its vertex indices, the light of all vertices, and the scale of the light."""

    mesh: Any
    used: NDArray[np.integer]
    light_of: NDArray[np.float32]
    scale: NDArray[np.float32]

    def show(self, points: NDArray[np.float32]) -> None:
        """Set vertex positions from `points` (V, 3), mm, and colours from the light."""
        colours = np.minimum(self.light_of[self.used] * (self.scale * 255), 255) + np.float32(0.5)
        self.mesh.points[:] = points[self.used]
        self.mesh.point_data["light"][:] = colours.astype(np.uint8)
        self.mesh.GetPoints().Modified()
        self.mesh.point_data["light"].VTKObject.Modified()
        self.mesh.Modified()


class PlottedFace:
    """Meshes of a face in a plotter: textured, plain and translucent, each with an outer and an inner side."""

    def __init__(self, surface: Surface, plotter: Any) -> None:
        self._plotter, self._surface = plotter, surface
        self._light: VertexLight = build_vertex_light(surface)
        self._meshes: list[PlottedMesh] = []
        shade = triangle_shades(self._light)
        opacity = surface.materials[surface.part_of, OPACITY]
        has_holes = surface.phase[:, 0] >= HOLES  # cards of strands are drawn as parts with holes
        groups = np.column_stack([-opacity, shade, np.where(shade >= 0, surface.texture_of, -1), has_holes])
        for group in np.unique(groups, axis=0):
            self._add((groups == group).all(axis=1), -float(group[0]), (int(group[2]), bool(group[3])))

    def show(
        self, points: NDArray[np.float32], view: NDArray[np.floating], lights: tuple[NDArray[Any], NDArray[Any]]
    ) -> None:
        """Set vertex positions (V, 3), mm, and light them for a camera `view` (3, 4)."""
        self._light.update(points, view, lights)
        for mesh in self._meshes:
            mesh.show(points)

    def _add(self, chosen: NDArray[np.bool_], opacity: float, texture: tuple[int, bool]) -> None:
        """Add triangles with a texture, -1 for vertex colours, and whether it has holes."""
        import pyvista

        used, places = np.unique(self._surface.triangles[chosen], return_inverse=True)
        scale, options = np.ones(3, np.float32), {"opacity": opacity}
        number, has_holes = texture
        if number >= 0:
            image = self._surface.textures[number]
            scale = self._light.albedo[used].max(axis=0)
            pixels = brighten(image.pixels, scale)
            if has_holes and image.alpha is not None:
                pixels = np.dstack([pixels, np.where(image.alpha >= HALF_COVERED, np.uint8(255), np.uint8(0))])
            options["texture"] = pyvista.Texture(pixels)
        for culling, light_of in (("front", self._light.back), ("back", self._light.front)):
            mesh = pyvista.PolyData.from_regular_faces(self._surface.rig.rest[used].copy(), places.reshape(-1, 3))
            mesh.point_data["light"] = np.zeros((len(used), 3), np.uint8)
            if number >= 0:
                mesh.active_texture_coordinates = self._surface.uv[used] * [1, -1] + np.array([0, 1], np.float32)
            self._plotter.add_mesh(
                mesh, scalars="light", rgb=True, lighting=False, culling=culling, show_scalar_bar=False, **options
            )
            self._meshes.append(PlottedMesh(mesh, used, light_of, scale))


def aim_camera(plotter: Any, optics: CameraMatrices, height: int) -> None:
    """Set the camera of a plotter from camera matrices for pictures of `height` samples."""
    view = optics.view
    place = -view[:, :3].T @ view[:, 3]
    camera = plotter.camera
    camera.position = tuple(place)
    camera.focal_point = tuple(place + max(float(view[2, 3]), 1.0) * view[2, :3])  # at the depth of the origin
    camera.up = tuple(-view[1, :3])
    camera.view_angle = math.degrees(2 * math.atan(height / 2 / float(optics.lens[0])))


def _plotter(size: tuple[int, int], scene: Scene) -> Any:
    import pyvista

    with use_window_class(OFF_SCREEN):
        plotter = pyvista.Plotter(off_screen=True, window_size=list(size), lighting="none")
    plotter.disable_anti_aliasing()
    plotter.set_background("black")
    aim_camera(plotter, scene.optics, size[1])
    return plotter


@kernel
def sum_samples(samples: Any, place: tuple[int, int], side: int, linear: Any, total: Any) -> None:
    """Write the sums (4,) of linear light and coverage over side x side samples from (row, column) `place`."""
    total[:] = np.float32(0)
    for row in range(place[0], place[0] + side):
        for column in range(place[1], place[1] + side):
            for c in range(3):
                total[c] += linear[samples[row, column, c]]
            total[3] += np.float32(samples[row, column, 3]) / np.float32(255)


@kernel
def average_samples(samples: Any, side: int, tables: Any, picture: Any) -> None:
    """Composite the mean of side x side samples (premultiplied sRGB and coverage) over the picture, in place."""
    one, half, share = np.float32(1), np.float32(0.5), np.float32(1.0 / (side * side))
    total = np.zeros(4, np.float32)
    for y in range(picture.shape[0]):
        for x in range(picture.shape[1]):
            sum_samples(samples, (y * side, x * side), side, tables[0], total)
            cover = total[3] * share
            if cover <= np.float32(0):
                continue
            behind, scale = one - cover, share
            if picture.shape[2] == 4:
                picture[y, x, 3] = np.uint8(min(cover, one) * np.float32(255) + half)
                behind, scale = np.float32(0), share / cover
            for c in range(3):
                value = min(total[c] * scale + behind * tables[0][picture[y, x, c]], one)
                picture[y, x, c] = tables[1][int(value * np.float32(len(tables[1]) - 1) + half)]
