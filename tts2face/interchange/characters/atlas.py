"""One texture for a face from the images of several materials, and the opacity of their triangles."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.interchange.characters.character import MASK, OPAQUE, Material
from tts2face.numeric.arrays import FloatArray
from tts2face.picture.kernels.tones import encoding_table, linear_light

MAX_ATLAS_SIDE = 4096  # pixels
BORDER = 4  # pixels around each image that repeat its edge, so that neighbours do not bleed into it
CLEAR, FULL = 32, 224  # of 255: pixels with less coverage count as holes, with more as covered
LEVELS = (0.3, 0.55, 0.8, 1.0)  # opacities in which translucent triangles are drawn
CUTOUT = 2.0  # opacity of triangles that are drawn where the coverage of the texture is
# of linear light: finer than an 8-bit step in the dark
TABLE_STEPS = 4096


@dataclass(frozen=True, slots=True, eq=False)
class Atlas:
    """Texture (H, W, 3), its coverage (H, W), and the place of each material's image: corner (x, y) and size (w, h)."""

    texture: NDArray[np.uint8] | None
    alpha: NDArray[np.uint8] | None
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
        return Atlas(None, None, {})
    # highest first: rows of images of like heights leave little room unused
    order = sorted(images, key=lambda number: (-images[number].shape[0], number))
    reduction = 1
    while True:
        sizes = {n: tuple(max(side // reduction, 1) for side in images[n].shape[1::-1]) for n in order}
        places, shape = _rows(order, sizes)
        if max(shape) <= MAX_ATLAS_SIDE:
            break
        reduction *= 2
    texture = np.zeros((shape[1], shape[0], 4), np.uint8)
    for number, (x, y, width, height) in places.items():
        image = images[number]
        if reduction > 1:
            image = np.array(Image.fromarray(image).resize((width, height), Image.Resampling.BOX))
        bordered = np.pad(image, ((BORDER, BORDER), (BORDER, BORDER), (0, 0)), mode="edge")
        texture[y - BORDER : y + height + BORDER, x - BORDER : x + width + BORDER] = bordered
    return Atlas(np.ascontiguousarray(texture[:, :, :3]), np.ascontiguousarray(texture[:, :, 3]), places)


def triangle_opacity(material: Material, corners: FloatArray) -> FloatArray:
    """Opacity (F,) of triangles with texture coordinates (F, 3, 2) of a material.

    1 where they are opaque, 0 where nothing of them is visible, one of `LEVELS` where they are evenly translucent, and
    `CUTOUT` where the image has holes or edges within them. An image counts by its pixels in the box around each
    triangle, so that no visible pixel is missed.
    """
    if material.alpha_mode == OPAQUE:
        return np.ones(len(corners))
    covered = coverage(material)
    # texture coordinates of a stranger's file may be infinite
    if material.image is None or not np.isfinite(corners).all():
        return np.full(len(corners), _level(float(covered.mean()) / 255.0))
    height, width = covered.shape
    low = np.floor(corners.min(axis=1) * [width, height] - 0.5).astype(np.int64).clip(0, [width - 1, height - 1])
    high = np.ceil(corners.max(axis=1) * [width, height] - 0.5).astype(np.int64).clip(low, [width - 1, height - 1])
    n_pixels = (high - low + 1).prod(axis=1)
    n_clear, n_full = (_count(covered < CLEAR, low, high), _count(covered >= FULL, low, high))
    n_middle = n_pixels - n_clear - n_full
    opacity = np.full(len(corners), CUTOUT)
    opacity[n_clear == n_pixels] = 0.0
    opacity[n_full == n_pixels] = 1.0
    even = np.flatnonzero(n_middle == n_pixels)
    total = _count(covered, low[even], high[even])
    opacity[even] = [_level(float(mean)) for mean in total / n_pixels[even] / 255.0]
    return opacity


def coverage(material: Material) -> NDArray[np.uint8]:
    """Coverage (H, W) of a material, 0 to 255; masked pixels are 0 or 255."""
    alpha = np.full((1, 1), 255, np.uint8) if material.image is None else material.image[:, :, 3]
    if material.alpha_mode == OPAQUE:
        return np.full_like(alpha, 255)
    scaled = alpha * material.colour[3]
    if material.alpha_mode == MASK:
        return np.where(scaled >= material.cutoff * 255.0, np.uint8(255), np.uint8(0))
    covered: NDArray[np.uint8] = np.rint(scaled).astype(np.uint8)
    return covered


def _count(values: NDArray[Any], low: NDArray[np.int64], high: NDArray[np.int64]) -> NDArray[np.int64]:
    """Sums (F,) of an image in boxes from pixel `low` to pixel `high`, (F, 2) each, both included."""
    sums = np.zeros((values.shape[0] + 1, values.shape[1] + 1), np.int64)
    sums[1:, 1:] = values.astype(np.int64).cumsum(axis=0).cumsum(axis=1)
    (left, top), (right, bottom) = low.T, high.T + 1
    within: NDArray[np.int64] = sums[bottom, right] - sums[top, right] - sums[bottom, left] + sums[top, left]
    return within


def _level(opacity: float) -> float:
    """The nearest of `LEVELS`; 0 for an opacity that is not seen."""
    return 0.0 if opacity < CLEAR / 255.0 else min(LEVELS, key=lambda level: abs(level - opacity))


def srgb(linear: FloatArray) -> NDArray[np.uint8]:
    """8-bit sRGB values of linear light."""
    steps = np.rint(np.clip(linear, 0.0, 1.0) * (TABLE_STEPS - 1)).astype(np.int64)
    return encoding_table(TABLE_STEPS)[steps]


def _coloured(material: Material) -> NDArray[np.uint8]:
    """Image (H, W, 4) of a material: its colours times the material's colour, and its coverage."""
    image = np.zeros((1, 1, 4), np.uint8) if material.image is None else material.image
    factor = np.array(material.colour[:3])
    # alpha is coverage, which `coverage` reads
    colours = image[:, :, :3]
    if not (factor > 0.999).all():
        tables = [srgb(linear_light(np.arange(256, dtype=np.uint8)).astype(np.float64) * share) for share in factor]
        colours = np.stack([table[image[:, :, channel]] for channel, table in enumerate(tables)], axis=2)
    covered = coverage(material)
    return np.dstack([fill_uncovered(colours, covered), covered])


def fill_uncovered(colours: NDArray[np.uint8], covered: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Colours (H, W, 3) whose pixels with little coverage (H, W) have the mean colour of covered pixels near them.

    Edges of cut-outs are interpolated between pixels, and the hidden colours beyond them are often black or white.
    """
    if (covered >= FULL).all() or not (covered >= FULL).any():
        return colours
    sums = np.dstack([colours, np.ones(covered.shape, np.uint8)]) * (covered >= FULL)[:, :, None].astype(np.float32)
    levels = [sums]
    # a pyramid: colours of near pixels come from its fine levels, of far ones from coarse ones
    while min(levels[-1].shape[:2]) > 1:
        height, width = levels[-1].shape[:2]
        even = np.pad(levels[-1], ((0, height % 2), (0, width % 2), (0, 0)))
        levels.append(even[::2, ::2] + even[1::2, ::2] + even[::2, 1::2] + even[1::2, 1::2])
    filled = levels[-1][:, :, :3] / np.maximum(levels[-1][:, :, 3:], 1)
    for level in reversed(levels[:-1]):
        below = filled.repeat(2, axis=0).repeat(2, axis=1)[: level.shape[0], : level.shape[1]]
        filled = np.where(level[:, :, 3:] > 0, level[:, :, :3] / np.maximum(level[:, :, 3:], 1), below)
    near: NDArray[np.uint8] = np.where((covered < FULL)[:, :, None], np.rint(filled).astype(np.uint8), colours)
    return near


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
            x = 0
            y = y + row_height
            row_height = 0
        places[number] = (x + BORDER, y + BORDER, width, height)
        x += width + 2 * BORDER
        right, row_height = max(right, x), max(row_height, height + 2 * BORDER)
    return places, (right, y + row_height)
