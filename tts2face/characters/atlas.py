"""One texture for a face from the images of several materials, and the opacity of triangles from their alpha."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tts2face.characters.character import BLEND, MASK, OPAQUE, Material
from tts2face.render.surface import encoding_table, linear_light

MAX_ATLAS_SIDE = 4096  # pixels
BORDER = 4  # pixels around each image that repeat its edge, so that neighbours do not bleed into it
SAMPLES = np.array(
    [[1, 1, 1], [4, 1, 1], [1, 4, 1], [1, 1, 4], [2, 2, 1], [2, 1, 2], [1, 2, 2]], np.float64
)  # barycentric places at which a triangle's alpha is read
SAMPLES = SAMPLES / SAMPLES.sum(axis=1, keepdims=True)
CLEAR = 0.12  # mean alpha below which a triangle is left out
LEVELS = (0.3, 0.55, 0.8, 1.0)  # opacities in which translucent triangles are drawn
TABLE_STEPS = 4096

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Atlas:
    """Texture (H, W, 3) with the place of each material's image: corner (x, y) and size (w, h) in pixels."""

    texture: NDArray[np.uint8] | None
    places: dict[int, tuple[int, int, int, int]]

    def coordinates(self, material: int, uv: FloatArray) -> FloatArray:
        """Texture coordinates (N, 2) in the atlas of coordinates in one image; beyond its edge they are clamped."""
        x, y, width, height = self.places[material]
        if self.texture is None:
            return uv
        pixels = np.array([x, y]) + np.clip(uv, 0.0, 1.0) * np.array([width, height])
        placed: FloatArray = pixels / np.array(self.texture.shape[1::-1])
        return placed


def build_atlas(materials: dict[int, Material]) -> Atlas:
    """Atlas of the images of the used materials, in rows; reduced until it fits `MAX_ATLAS_SIDE`."""
    from PIL import Image

    images = {number: _coloured(material) for number, material in materials.items() if material.image is not None}
    if not images:
        return Atlas(None, {})
    order = sorted(images, key=lambda number: (-images[number].shape[0], number))
    reduction = 1
    while True:
        sizes = {n: tuple(max(side // reduction, 1) for side in images[n].shape[1::-1]) for n in order}
        places, shape = _rows(order, sizes)
        if max(shape) <= MAX_ATLAS_SIDE:
            break
        reduction *= 2
    texture = np.zeros((shape[1], shape[0], 3), np.uint8)
    for number, (x, y, width, height) in places.items():
        image = images[number]
        if reduction > 1:
            image = np.array(Image.fromarray(image).resize((width, height), Image.Resampling.BOX))
        bordered = np.pad(image, ((BORDER, BORDER), (BORDER, BORDER), (0, 0)), mode="edge")
        texture[y - BORDER : y + height + BORDER, x - BORDER : x + width + BORDER] = bordered
    return Atlas(texture, places)


def triangle_alpha(material: Material, corners: FloatArray) -> FloatArray:
    """Mean alpha (F,) of triangles with texture coordinates (F, 3, 2) of a material."""
    alpha = np.full(len(corners), material.colour[3])
    if material.alpha_mode == OPAQUE:
        return np.ones(len(corners))
    if material.image is not None and np.isfinite(corners).all():
        height, width = material.image.shape[:2]
        at = np.einsum("sk,fkd->fsd", SAMPLES, corners) % 1.0
        column = np.minimum((at[..., 0] * width).astype(np.int64), width - 1)
        row = np.minimum((at[..., 1] * height).astype(np.int64), height - 1)
        read = material.image[row, column, 3] / 255.0
        alpha = alpha * ((read >= material.cutoff) if material.alpha_mode == MASK else read).mean(axis=1)
    return alpha


def opacity_levels(material: Material, alpha: FloatArray) -> FloatArray:
    """Opacity (F,) in which triangles of a mean alpha are drawn; 0 for those that are left out."""
    if material.alpha_mode == OPAQUE:
        return np.ones(len(alpha))
    if material.alpha_mode == MASK:
        return np.where(alpha >= 0.5, 1.0, 0.0)
    levels = np.array(LEVELS)
    nearest = levels[np.abs(alpha[:, None] - levels).argmin(axis=1)]
    kept: FloatArray = np.where(alpha < CLEAR, 0.0, nearest)
    return kept if material.alpha_mode == BLEND else np.ones(len(alpha))


def srgb(linear: FloatArray) -> NDArray[np.uint8]:
    """8-bit sRGB values of linear light."""
    steps = np.rint(np.clip(linear, 0.0, 1.0) * (TABLE_STEPS - 1)).astype(np.int64)
    return encoding_table(TABLE_STEPS)[steps]


def _coloured(material: Material) -> NDArray[np.uint8]:
    """Image (H, W, 3) of a material times its colour."""
    image = np.zeros((1, 1, 4), np.uint8) if material.image is None else material.image
    factor = np.array(material.colour[:3])
    if (factor > 0.999).all():
        return np.ascontiguousarray(image[:, :, :3])
    tables = [srgb(linear_light(np.arange(256, dtype=np.uint8)).astype(np.float64) * share) for share in factor]
    return np.stack([table[image[:, :, channel]] for channel, table in enumerate(tables)], axis=2)


def _rows(
    order: list[int], sizes: dict[int, tuple[int, ...]]
) -> tuple[dict[int, tuple[int, int, int, int]], tuple[int, int]]:
    """Places of images in rows about as wide as the whole is high, and the size (width, height) of all."""
    area = sum((sizes[n][0] + 2 * BORDER) * (sizes[n][1] + 2 * BORDER) for n in order)
    widest = max(sizes[n][0] + 2 * BORDER for n in order)
    limit = max(widest, int(1.2 * area**0.5))
    places: dict[int, tuple[int, int, int, int]] = {}
    x = y = row_height = right = 0
    for number in order:
        width, height = sizes[number]
        if x and x + width + 2 * BORDER > limit:
            x, y, row_height = 0, y + row_height, 0
        places[number] = (x + BORDER, y + BORDER, width, height)
        x += width + 2 * BORDER
        right, row_height = max(right, x), max(row_height, height + 2 * BORDER)
    return places, (right, y + row_height)
