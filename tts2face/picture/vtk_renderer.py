"""VTK renderer, off screen with a GPU or software GL; vertices are lit by `tts2face.picture.kernels.shade`.

VTK ends the process when it finds no GL, so a child process probes it first.

Per-vertex lighting, for renderers that interpolate vertex colours.
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
from tts2face.numeric.kernels import kernel
from tts2face.picture.camera import CameraMatrices
from tts2face.picture.kernels.fragments import BACK_LIGHT_SHARE, face_normals, vertex_normals
from tts2face.picture.kernels.raster import HOLES
from tts2face.picture.kernels.shade import N_SCRATCH_ROWS, light_vertices, scatter_light, shade_fragments
from tts2face.picture.kernels.tables import (
    AT_ALBEDO,
    AT_DIFFUSE,
    AT_EXPOSURE,
    AT_GLOSS,
    AT_NORMAL,
    AT_RAY,
    AT_SHARE,
    DIFFUSE,
    EXPOSURE,
    N_EXPOSURES,
    N_ROWS,
    NORMAL,
    OPACITY,
    OPEN_SURFACE,
    TEXTURE,
    encoding_table,
    linear_table,
)
from tts2face.picture.scene import Scene
from tts2face.picture.surface import Surface
from tts2face.picture.textures import read_texel
from tts2face.processes.child import Call, Handler
from tts2face.processes.parent import Child
from tts2face.processes.program import Program

SRGB_TABLE = (encoding_table(4096) / 255.0).astype(np.float32)  # sRGB in [0, 1] for equal steps of linear light
SHADE_STEP, N_SHADES = 1.5, 6  # brightness ratio and number of the copies of a texture


@dataclass(frozen=True, slots=True, eq=False)
class VertexLight:
    """Vertex lighting of one surface, with its buffers.

    ``table`` (N_ROWS, V) holds one fragment per vertex in the rows of `tts2face.picture.kernels.tables`; ``albedo``
    (V, 3) is the unlit sRGB colour in [0, 1], ``divisor`` (V, 3) that colour on textured vertices, else the opacity;
    ``front`` and ``back`` (V, 3) are the colours of outer and inner sides after the last `update`, sRGB
    divided by ``divisor``.
    """

    surface: Surface
    camera: NDArray[np.float32]
    flat: NDArray[np.float32]
    table: NDArray[np.float32]
    inside: NDArray[np.float32]
    albedo: NDArray[np.float32]
    divisor: NDArray[np.float32]
    front: NDArray[np.float32]
    back: NDArray[np.float32]

    def update(
        self, points: NDArray[np.float32], view: NDArray[np.floating], lights: tuple[NDArray[Any], NDArray[Any]]
    ) -> None:
        """Light the vertices at world positions (V, 3) for a camera `view` (3, 4); writes ``front`` and ``back``.

        `lights` holds the light table of `tts2face.picture.kernels.shade.light_vertices` in camera space and exposure
        (V, 5).
        Strands are lit as plain surfaces.
        """
        self.camera[:, :3] = points @ view[:, :3].T.astype(np.float32) + view[:, 3].astype(np.float32)
        face_normals(self.camera, self.surface.triangles, self.flat)
        vertex_normals(self.flat, self.surface.starts, self.surface.members, self.camera)
        light_vertices(lights[1], lights[0], self.surface.wrap, self.camera)
        skin = self.surface.skin
        if len(skin.vertices):
            around = (skin.vertices, self.surface.starts, self.surface.members, skin.triangles)
            scatter_light(self.surface.triangles, around, skin.share, self.camera, np.zeros_like(self.flat))
        for side, colours in ((1.0, self.front), (-1.0, self.back)):
            self._write(np.float32(side), lights[0], colours)

    def _write(self, side: np.float32, lights: NDArray[Any], colours: NDArray[np.float32]) -> None:
        table, n_vertices = self.table, len(self.camera)
        table[AT_NORMAL : AT_NORMAL + 3] = side * self.camera[:, NORMAL : NORMAL + 3].T
        inside = np.float32(1) if side > 0 else self.inside
        table[AT_DIFFUSE : AT_DIFFUSE + 3] = self.camera[:, DIFFUSE : DIFFUSE + 3].T * inside
        table[AT_EXPOSURE : AT_EXPOSURE + N_EXPOSURES] = self.camera[:, EXPOSURE : EXPOSURE + N_EXPOSURES].T * inside
        table[AT_RAY : AT_RAY + 2] = (self.camera[:, :2] / np.maximum(self.camera[:, 2:3], np.float32(1))).T
        light_of = np.zeros((3, n_vertices), np.float32)
        shade_fragments(table, n_vertices, lights, np.zeros((N_SCRATCH_ROWS, n_vertices), np.float32), light_of)
        colours[:] = encode_srgb(light_of.T) / self.divisor


def build_vertex_light(surface: Surface) -> VertexLight:
    """Vertex lighting of a surface."""
    n_vertices = len(surface.rig.rest)
    part_of = np.zeros(n_vertices, np.int32)
    part_of[surface.triangles.ravel()] = np.repeat(surface.part_of, 3)
    material = surface.materials[part_of]
    texture = material[:, TEXTURE].astype(np.int64)
    textured = texture >= 0
    linear = surface.colours.copy()
    sample_texture((surface.texels, surface.levels), linear_table(), surface.uv, texture, linear)
    table = np.zeros((N_ROWS, n_vertices), np.float32)
    table[AT_ALBEDO : AT_ALBEDO + 3] = linear.T
    table[AT_GLOSS : AT_GLOSS + 5] = material[:, :5].T
    table[AT_SHARE] = 1
    albedo = np.maximum(encode_srgb(linear), np.float32(1 / 255))
    light_of = np.zeros((2, n_vertices, 3), np.float32)
    return VertexLight(
        surface=surface,
        camera=np.zeros((n_vertices, EXPOSURE + N_EXPOSURES), np.float32),
        flat=np.zeros((len(surface.triangles), 3), np.float32),
        table=table,
        inside=np.where(material[:, OPEN_SURFACE] > 0, np.float32(1), BACK_LIGHT_SHARE),
        albedo=albedo,
        divisor=np.where(
            textured[:, None], albedo, np.maximum(material[:, OPACITY : OPACITY + 1], np.float32(1 / 255))
        ),
        front=light_of[0],
        back=light_of[1],
    )


def encode_srgb(linear: NDArray[np.float32]) -> NDArray[np.float32]:
    """Linear light as sRGB in [0, 1]."""
    steps = np.clip(linear, 0.0, 1.0) * np.float32(len(SRGB_TABLE) - 1) + np.float32(0.5)
    srgb: NDArray[np.float32] = SRGB_TABLE[steps.astype(np.intp)]
    return srgb


def brighten(texture: NDArray[np.uint8], peak: NDArray[np.floating]) -> NDArray[np.uint8]:
    """Texture (H, W, 3) scaled so that `peak` (3,), sRGB in [0, 1], becomes full brightness."""
    scaled: NDArray[np.uint8] = np.rint(np.minimum(texture / peak, 255.0)).astype(np.uint8)
    return scaled


def triangle_shades(light_of: VertexLight) -> NDArray[np.int64]:
    """Shade (F,) of each triangle: 0 is the brightest, each further one darker by `SHADE_STEP`; -1 without a texture.

    Light only darkens the texture that it multiplies; each shade is therefore drawn with a brightened copy.
    """
    surface = light_of.surface
    tone = light_of.albedo.mean(axis=1)[surface.triangles].max(axis=1)
    steps = np.clip(np.floor(-np.log(tone) / np.log(SHADE_STEP)), 0, N_SHADES - 1).astype(np.int64)
    chosen: NDArray[np.int64] = np.where(surface.materials[surface.part_of, TEXTURE] >= 0, steps, -1)
    return chosen


@kernel
def sample_texture(textures: Any, linear: Any, uv: Any, texture: Any, albedo: Any) -> None:
    """Write the linear colour of vertices with a texture (V,), -1 without, to `albedo` (V, 3)."""
    texels, levels = textures
    for v in range(len(texture)):
        if texture[v] >= 0:
            place = (levels[texture[v], 0, 0], levels[texture[v], 0, 1], levels[texture[v], 0, 2])
            albedo[v, 0], albedo[v, 1], albedo[v, 2], _ = read_texel(texels, place, linear, uv[v, 0], uv[v, 1])


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
