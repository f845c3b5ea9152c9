"""Colours of vertices as a texture, for programs that show textures alone: each surface has a tile of it.

A tile holds the plane through the colours of a surface that fits them best, in linear light, so that what lies between
vertices is mixed as between the vertices themselves. Teeth, tongue and hair have colours and their shades, which lie in
a plane within a step of 255.
"""

import numpy as np
from numpy.typing import NDArray

from tts2face.numeric.arrays import FloatArray, encode_srgb

TILE_PX = 32  # a side: a texel is a step of 255 of a surface whose colours differ by 30 of them
MARGIN_PX = 2.0  # around the used part of a tile, which smaller copies of the texture would mix with others
LEAST_RANGE = 1e-6  # of linear light


def colour_tiles(colours: list[FloatArray]) -> tuple[NDArray[np.uint8], list[FloatArray]]:
    """Texture (S, S, 3), sRGB, and places (n, 2) in it of the linear colours (n, 3) of each surface, from its top left.

    Places are shares of its side, as texture coordinates are.
    """
    side = int(np.ceil(np.sqrt(max(len(colours), 1))))
    pixels = np.zeros((side * TILE_PX, side * TILE_PX, 3), np.uint8)
    places = []
    for number, own in enumerate(colours):
        middle = own.mean(axis=0)
        away = own - middle
        axes = np.linalg.eigh(away.T @ away)[1][:, 1:].T
        along = away @ axes.T
        low, extent = along.min(axis=0), np.maximum(np.ptp(along, axis=0), LEAST_RANGE)
        steps = (np.arange(TILE_PX) + 0.5 - MARGIN_PX) / (TILE_PX - 2 * MARGIN_PX)
        column, row = np.meshgrid(low[0] + steps * extent[0], low[1] + steps * extent[1])
        tile = middle + column[..., None] * axes[0] + row[..., None] * axes[1]
        corner = np.array([number % side, number // side]) * TILE_PX
        pixels[corner[1] : corner[1] + TILE_PX, corner[0] : corner[0] + TILE_PX] = encode_srgb(tile)
        places.append((corner + MARGIN_PX + (along - low) / extent * (TILE_PX - 2 * MARGIN_PX)) / (side * TILE_PX))
    return pixels, places
