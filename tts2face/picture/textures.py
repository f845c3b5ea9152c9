"""Textures with their mipmaps in one table of texels, and reading from it."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.models.face import Texture
from tts2face.numeric.arrays import Array
from tts2face.numeric.kernels import HALF, UNIT, ZERO, kernel

N_LEVELS = 8  # a texture of 2048 pixels down to 16
SHARP_TEXELS = np.float32(2.2)  # texels under a pixel up to which the finer level is read


@kernel
def mip_level(texels_per_pixel: float, n_levels: int) -> int:
    """Level of a texture whose texels are about as large as a pixel."""
    level, ratio = 0, np.float32(texels_per_pixel)
    while ratio > SHARP_TEXELS and level < n_levels - 1:
        ratio *= np.float32(0.25)
        level += 1
    return level


@kernel
def read_texel(
    texels: Array, place: tuple[int, int, int], linear: Array, u: float, v: float
) -> tuple[float, float, float, float]:
    """Bilinear colour in linear light, and coverage in [0, 1], at (u, v) of a level (first texel, width, height)."""
    start, width, height = place
    x = min(max(u * np.float32(width) - HALF, ZERO), np.float32(width - 1))
    y = min(max(v * np.float32(height) - HALF, ZERO), np.float32(height - 1))
    left, top = int(x), int(y)
    across, along = x - np.float32(left), y - np.float32(top)
    right, below = 1 if left + 1 < width else 0, width if top + 1 < height else 0
    p = start + top * width + left
    w0, w1 = (UNIT - across) * (UNIT - along), across * (UNIT - along)
    w2, w3 = (UNIT - across) * along, across * along
    q, r, s = p + right, p + below, p + below + right
    red = linear[texels[p, 0]] * w0 + linear[texels[q, 0]] * w1 + linear[texels[r, 0]] * w2 + linear[texels[s, 0]] * w3
    green = (
        linear[texels[p, 1]] * w0 + linear[texels[q, 1]] * w1 + linear[texels[r, 1]] * w2 + linear[texels[s, 1]] * w3
    )
    blue = linear[texels[p, 2]] * w0 + linear[texels[q, 2]] * w1 + linear[texels[r, 2]] * w2 + linear[texels[s, 2]] * w3
    coverage = texels[p, 3] * w0 + texels[q, 3] * w1 + texels[r, 3] * w2 + texels[s, 3] * w3
    return red, green, blue, coverage * np.float32(1 / 255)


def pack_textures(
    textures: tuple[Texture, ...], tables: tuple[Any, Any]
) -> tuple[NDArray[np.uint8], NDArray[np.int64]]:
    """Texels (N, 4), sRGB and coverage, of all levels of all textures, and the places of the levels (T, L, 3).

    A place is the first texel, the width and the height. `tables` convert between 8-bit sRGB and linear
    light. Coarser levels average the light of visible texels.
    """
    parts: list[NDArray[np.uint8]] = []
    levels = np.zeros((max(len(textures), 1), N_LEVELS, 3), np.int64)
    levels[:, :, 1:] = 1
    start = 0
    for number, texture in enumerate(textures):
        level = np.zeros((*texture.pixels.shape[:2], 4), np.uint8)
        level[:, :, :3], level[:, :, 3] = texture.pixels, 255 if texture.alpha is None else texture.alpha
        for depth in range(N_LEVELS):
            parts.append(level.reshape(-1, 4))
            levels[number, depth] = start, level.shape[1], level.shape[0]
            start += level.shape[0] * level.shape[1]
            if depth < N_LEVELS - 1:
                coarse = np.zeros(((level.shape[0] + 1) // 2, (level.shape[1] + 1) // 2, 4), np.uint8)
                halve(level, tables[0], tables[1], coarse)
                level = coarse
    return np.concatenate(parts) if parts else np.zeros((1, 4), np.uint8), levels


@kernel
def halve(fine: Array, linear: Array, encoded: Array, coarse: Array) -> None:
    """Write a level of half the size."""
    total = np.zeros(4, np.float32)
    top = np.float32(len(encoded) - 1)
    for y in range(coarse.shape[0]):
        for x in range(coarse.shape[1]):
            total[0] = total[1] = total[2] = total[3] = np.float32(0)
            for row in (2 * y, min(2 * y + 1, fine.shape[0] - 1)):
                for column in (2 * x, min(2 * x + 1, fine.shape[1] - 1)):
                    # colours of hidden texels do not count, unless all four are hidden
                    weight = np.float32(fine[row, column, 3]) + np.float32(1e-3)
                    for c in range(3):
                        total[c] += weight * linear[fine[row, column, c]]
                    total[3] += weight
            for c in range(3):
                coarse[y, x, c] = encoded[int(min(total[c] / total[3], np.float32(1)) * top + np.float32(0.5))]
            coarse[y, x, 3] = np.uint8(min(total[3] * np.float32(0.25) + np.float32(0.5), np.float32(255)))
