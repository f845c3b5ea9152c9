"""Materials of USD files: UsdPreviewSurface, whose colours are textures beside the file.

Also colours of vertices are a texture: a reader of `displayColor` in its place makes TinyUSDZ 0.9.4 refuse the file.
Source: UsdPreviewSurface Specification 2.6, https://openusd.org/release/spec_usdpreviewsurface.html.
"""

import re
from pathlib import Path
from typing import Any

import numpy as np

from tts2face.interchange.exports.colour_tiles import colour_tiles
from tts2face.interchange.exports.parts import Target
from tts2face.interchange.exports.surfaces import (
    ExportSurface,
    linear_colours,
    reflection,
    roughness,
    texture_jpeg,
    texture_png,
)
from tts2face.models.face import VERTEX_COLOURS, Face
from tts2face.numeric.arrays import FloatArray

HALF_COVERED = 0.5  # coverage of a texture from which a part that is cut out by it is drawn
COORDINATES = "st"


class TextureFiles:
    """Files of the textures of a face, by their numbers, and of the colours of its vertices."""

    def __init__(self, target: Target, face: Face, surfaces: list[ExportSurface]) -> None:
        self._face = face
        self._coloured = [number for number, surface in enumerate(surfaces) if not _is_textured(surface, face)]
        colours = linear_colours(face)
        self._tiles, places = colour_tiles([colours[surfaces[number].vertices] for number in self._coloured])
        self._places = dict(zip(self._coloured, places, strict=True))
        self._names: dict[int, str] = {}
        self._paths: dict[int, Path] = {}
        for surface in surfaces:
            number = surface.part.texture if _is_textured(surface, face) else VERTEX_COLOURS
            if number not in self._names:
                part = re.sub(r"[^A-Za-z0-9_]", "_", surface.part.name)
                is_opaque = number != VERTEX_COLOURS and face.textures[number].alpha is None
                name = "colours" if number == VERTEX_COLOURS else f"{part}_{number}"
                self._names[number] = f"{target.name}.{name}.{'jpg' if is_opaque else 'png'}"
                self._paths[number] = target.beside(self._names[number])

    def of(self, number: int, surface: ExportSurface) -> tuple[str, FloatArray]:
        """Name of the file of a surface, the given one of all, and its places (n, 2) in it from the bottom left."""
        texture, places = VERTEX_COLOURS, self._places.get(number)
        if places is None:
            texture, places = surface.part.texture, np.asarray(self._face.uv)[surface.vertices]
        return self._names[texture], places * [1, -1] + [0, 1]

    def write(self) -> dict[str, Path]:
        """Write all textures; the paths, by the names that the files receive."""
        for number, path in self._paths.items():
            path.write_bytes(self._content(number))
        return {self._names[number]: path for number, path in self._paths.items()}

    def _content(self, number: int) -> bytes:
        if number == VERTEX_COLOURS:
            return texture_png(self._tiles)
        texture = self._face.textures[number]
        return texture_jpeg(texture.pixels) if texture.alpha is None else texture_png(texture.pixels, texture.alpha)


def define_material(
    usd: Any, stage: Any, mesh: Any, surface: ExportSurface, path: str, texture: tuple[str, FloatArray]
) -> None:
    """Define the material of a mesh at a path, with its texture: name of the file, and places (n, 2) of the vertices.

    `usd` has the modules of usd-core.
    """
    part = surface.part
    types, shade = usd.Sdf.ValueTypeNames, usd.UsdShade
    coordinates = usd.UsdGeom.PrimvarsAPI(mesh).CreatePrimvar(
        COORDINATES, types.TexCoord2fArray, usd.UsdGeom.Tokens.vertex
    )
    coordinates.Set(usd.Vt.Vec2fArray.FromNumpy(np.ascontiguousarray(texture[1], np.float32)))
    material = shade.Material.Define(stage, path)
    reader = shade.Shader.Define(stage, f"{path}/Coordinates")
    reader.CreateIdAttr("UsdPrimvarReader_float2")
    reader.CreateInput("varname", types.String).Set(COORDINATES)
    picture = shade.Shader.Define(stage, f"{path}/Texture")
    picture.CreateIdAttr("UsdUVTexture")
    picture.CreateInput("file", types.Asset).Set(f"./{texture[0]}")
    picture.CreateInput("sourceColorSpace", types.Token).Set("sRGB")
    for side in ("wrapS", "wrapT"):
        picture.CreateInput(side, types.Token).Set("clamp")
    picture.CreateInput("st", types.Float2).ConnectToSource(reader.CreateOutput("result", types.Float2))
    shader = shade.Shader.Define(stage, f"{path}/Surface")
    shader.CreateIdAttr("UsdPreviewSurface")
    shader.CreateInput("roughness", types.Float).Set(round(roughness(part), 4))
    shader.CreateInput("metallic", types.Float).Set(0.0)
    shader.CreateInput("ior", types.Float).Set(round(_refraction(0.04 * reflection(part)), 4))
    opacity = shader.CreateInput("opacity", types.Float)
    opacity.Set(part.opacity)
    if part.cutout and part.is_textured:
        opacity.ConnectToSource(picture.CreateOutput("a", types.Float))
        shader.CreateInput("opacityThreshold", types.Float).Set(HALF_COVERED)
    shader.CreateInput("diffuseColor", types.Color3f).ConnectToSource(picture.CreateOutput("rgb", types.Float3))
    material.CreateSurfaceOutput().ConnectToSource(shader.CreateOutput("surface", types.Token))
    shade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(material)


def _refraction(reflected: float) -> float:
    """Index of refraction of a surface that reflects a share of the light that falls straight on it (Fresnel)."""
    root = float(np.sqrt(reflected))
    return (1 + root) / (1 - root)


def _is_textured(surface: ExportSurface, face: Face) -> bool:
    return surface.part.is_textured and face.uv is not None
