"""Per-vertex lighting, for renderers that interpolate vertex colours."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.compilation import kernel
from tts2face.render.fragment_rows import (
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
)
from tts2face.render.fragments import BACK_LIGHT_SHARE, face_normals, vertex_normals
from tts2face.render.shade import N_SCRATCH_ROWS, light_vertices, scatter_light, shade_fragments
from tts2face.render.surface import Surface
from tts2face.render.textures import read_texel
from tts2face.render.tone_tables import encoding_table, linear_table

SRGB_TABLE = (encoding_table(4096) / 255.0).astype(np.float32)  # sRGB in [0, 1] for equal steps of linear light
SHADE_STEP, N_SHADES = 1.5, 6  # brightness ratio and number of the copies of a texture


@dataclass(frozen=True, slots=True, eq=False)
class VertexLight:
    """Vertex lighting of one surface, with its buffers.

    ``table`` (N_ROWS, V) holds one fragment per vertex in the rows of `tts2face.render.fragment_rows`; ``albedo``
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

        `lights` holds the light table of `tts2face.render.shade.light_vertices` in camera space and exposure (V, 5).
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
