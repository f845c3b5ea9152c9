"""Compositing of fragments into pixels: layers over each other and over the background, encoded as sRGB."""

from typing import Any

import numpy as np

from tts2face.numeric.arrays import Array
from tts2face.numeric.kernels import HALF, UNIT, ZERO, inlined_kernel, kernel
from tts2face.picture.kernels.fragments import (
    PIXEL_ENDS,
    PIXEL_X,
    PIXEL_Y,
    Band,
    Facets,
    Fragments,
    is_same_surface,
)
from tts2face.picture.kernels.raster import NO_TRIANGLE
from tts2face.picture.kernels.tables import AT_OPACITY, AT_SHARE


@inlined_kernel
def write_pixel(light: tuple[Any, Any, Any], cover: Any, tables: tuple[Any, Any], picture: Array, at: Any) -> None:
    """Composite light and coverage over a pixel (y, x); a picture of four channels stores the coverage."""
    linear, encoded = tables
    y, x = at
    top = np.float32(len(encoded) - 1)
    behind, scale = UNIT - cover, UNIT
    if picture.shape[2] == 4:
        picture[y, x, 3] = np.uint8(min(cover, UNIT) * np.float32(255) + HALF)
        behind, scale = ZERO, UNIT / max(cover, np.float32(1e-6))
    red, green, blue = light[0] * scale, light[1] * scale, light[2] * scale
    if behind != ZERO:
        red += behind * linear[picture[y, x, 0]]
        green += behind * linear[picture[y, x, 1]]
        blue += behind * linear[picture[y, x, 2]]
    picture[y, x, 0] = encoded[int(min(max(red, ZERO), UNIT) * top + HALF)]
    picture[y, x, 1] = encoded[int(min(max(green, ZERO), UNIT) * top + HALF)]
    picture[y, x, 2] = encoded[int(min(max(blue, ZERO), UNIT) * top + HALF)]


@kernel
def mix_samples(band: Band, p: int, facets: Facets, fragments: Fragments, total: Array) -> None:
    """Add the mean over the samples of pixel number `p` of the composited layers: light and coverage (4,)."""
    pixel, table, colour = fragments.pixels[p], fragments.table, fragments.colour
    side, x, r = band.side, pixel[PIXEL_X], pixel[PIXEL_Y] - band.first_row // band.side
    for s in range(side * side):
        red, green, blue, coverage = np.float32(0), np.float32(0), np.float32(0), np.float32(0)
        passing = band.through[r, x, s] if band.through.size > 0 else UNIT
        for turn in range(3):
            layer = (0, 2, 1)[turn]
            g = pixel[PIXEL_ENDS + layer]
            if g == pixel[PIXEL_ENDS + layer + 1]:
                continue
            number = band.owner[layer, r * side + s // side, x * side + s % side]
            if number == NO_TRIANGLE:
                continue
            while not is_same_surface(number, fragments.number_of[g], facets):
                g += 1
            behind = UNIT - table[AT_OPACITY, g]
            red, green, blue = red * behind + colour[0, g], green * behind + colour[1, g], blue * behind + colour[2, g]
            coverage = UNIT - (UNIT - coverage) * behind
        share = passing / np.float32(side * side)
        total[0], total[1], total[2] = total[0] + red * share, total[1] + green * share, total[2] + blue * share
        total[3] += UNIT / np.float32(side * side) - share * (UNIT - coverage)


@kernel
def compose_band(
    band: Band, facets: Facets, fragments: Fragments, n_pixels: int, picture: Array, tables: tuple[Array, Array]
) -> None:
    """Write the pixels of a band over the background in a picture; `tables` convert between 8 bits and linear light."""
    rows = fragments.pixels
    table = fragments.table
    colour = fragments.colour
    through = band.through
    n_samples = band.side * band.side
    share = UNIT / np.float32(n_samples)
    total = np.zeros(4, np.float32)
    for p in range(n_pixels):
        start, end = rows[p, PIXEL_ENDS], rows[p, PIXEL_ENDS + 3]
        x, y = rows[p, PIXEL_X], rows[p, PIXEL_Y]
        r = y - band.first_row // band.side
        red = ZERO
        green = ZERO
        blue = ZERO
        rest = UNIT
        least = UNIT
        if through.size > 0:
            rest, least = ZERO, through[r, x, 0]
            for s in range(n_samples):
                rest += through[r, x, s]
                least = min(least, through[r, x, s])
            rest /= np.float32(n_samples)
            if least < UNIT:
                red, green, blue = band.strand_colour[r, x, 0], band.strand_colour[r, x, 1], band.strand_colour[r, x, 2]
        if end == start:  # hair only
            write_pixel((red, green, blue), UNIT - rest, tables, picture, (y, x))
        elif least < UNIT or rows[p, PIXEL_ENDS + 1] < end:
            total[0], total[1], total[2], total[3] = red, green, blue, ZERO
            mix_samples(band, p, facets, fragments, total)
            write_pixel((total[0], total[1], total[2]), total[3], tables, picture, (y, x))
        else:
            cover = ZERO
            for g in range(start, end):
                weight = table[AT_SHARE, g] * share
                red, green, blue = (
                    red + colour[0, g] * weight,
                    green + colour[1, g] * weight,
                    blue + colour[2, g] * weight,
                )
                cover += weight
            write_pixel((red, green, blue), cover, tables, picture, (y, x))
