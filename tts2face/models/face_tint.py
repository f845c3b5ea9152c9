"""Tints of the parts of a face: factors of their colours, of vertices and of textures."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.models.face import Face, FacePart, Texture
from tts2face.models.late import Late

MAX_BRIGHTENED_LEVEL = 150  # upper limit of texels brightened by a tint: keeps skin colours at the edge of dark hair


def _part_texel_levels(face: Face, part: FacePart, shape: tuple[int, ...]) -> NDArray[np.uint8]:
    """Levels (H, W): 255 on the texels of a part, 0 elsewhere, with a soft edge."""
    from PIL import Image, ImageDraw, ImageFilter
    from scipy.ndimage import maximum_filter

    mask = Image.new("L", (shape[1], shape[0]))
    pen = ImageDraw.Draw(mask)
    places = np.asarray(face.uv, np.float64) * [shape[1], shape[0]] - 0.5
    for corners in places[face.triangles[part.first : part.first + part.count]].tolist():
        pen.polygon([tuple(corner) for corner in corners], fill=255, outline=255)
    wide = maximum_filter(np.asarray(mask), 9, mode="nearest")  # the bytes of Pillow's MaxFilter, 90 ms sooner
    return np.asarray(Image.fromarray(wide).filter(ImageFilter.GaussianBlur(1.5)))


def tint_parts(face: Face, tints: Mapping[str, Any]) -> Face:
    """A face whose parts, by name, have their sRGB colours multiplied by three factors, of vertices and textures."""
    colours = face.colours.copy()
    for part in face.parts:
        used = np.unique(face.triangles[part.first : part.first + part.count])
        colours[used] = np.clip(face.colours[used] * _tint(tints, part), 0, 255).astype(np.uint8)
    return replace(face, colours=colours, textures=Late(len(face.textures), lambda: _tinted(face, tints)))


def _tint(tints: Mapping[str, Any], part: FacePart) -> NDArray[np.float32]:
    return np.array(tints.get(part.name, (1.0, 1.0, 1.0)), np.float32)


def _tinted_levels(tint: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Levels (3, 256, 256) of each channel that a tint (3,) makes, by those of the part's share and of the texel."""
    share, own = np.arange(256, dtype=np.float32)[:, None] / np.float32(255), np.arange(256, dtype=np.float32)
    tinted = own * (1 + share * (tint[:, None, None] - 1))
    return np.clip(tinted, 0, np.maximum(own, MAX_BRIGHTENED_LEVEL)).astype(np.uint8)


def _tinted(face: Face, tints: Mapping[str, Any]) -> Iterator[Texture]:
    """The textures of a face in the tints of its parts."""
    textures = [texture.pixels for texture in face.textures]
    for part in face.parts:
        tint = _tint(tints, part)
        if part.is_textured and not np.all(tint == 1):
            texture = textures[part.texture]
            shares = 256 * _part_texel_levels(face, part, texture.shape).astype(np.int64)
            levels = _tinted_levels(tint)
            tinted = [levels[c].take(shares + texture[:, :, c]) for c in range(3)]
            textures[part.texture] = np.stack(tinted, axis=2)
    for pixels, old in zip(textures, face.textures, strict=True):
        yield Texture(pixels, old.alpha)
