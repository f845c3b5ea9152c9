"""Compositing of fragments into pixels: layers over each other and over the background, encoded as sRGB."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.compilation import kernel
from tts2face.render.fragments import AT_OPACITY, AT_SHARE, PIXEL_ENDS, PIXEL_X, PIXEL_Y, is_same_surface
from tts2face.render.raster import NO_TRIANGLE

Array = NDArray[Any]


@kernel
def write_pixel(total: Array, tables: tuple[Any, Any], picture: Array, x: int, y: int) -> None:
    """Composite light and coverage (4,) over a pixel; a picture of four channels stores the coverage."""
    linear, encoded = tables
    one, zero, half = np.float32(1), np.float32(0), np.float32(0.5)
    top = np.float32(len(encoded) - 1)
    behind, scale = one - total[3], one
    if picture.shape[2] == 4:
        picture[y, x, 3] = np.uint8(min(total[3], one) * np.float32(255) + half)
        behind, scale = zero, one / max(total[3], np.float32(1e-6))
    for c in range(3):
        value = total[c] * scale + behind * linear[picture[y, x, c]]
        picture[y, x, c] = encoded[int(min(max(value, zero), one) * top + half)]


@kernel
def mix_samples(
    samples: tuple[Any, int, int, int],
    begins: Array,
    which: tuple[Any, Any, Any],
    shading: tuple[Any, Any],
    total: Array,
) -> None:
    """Write the mean over a pixel's samples of the composited layers: light and coverage (4,).

    Parameters
    ----------
    samples
        Visible triangles (3, R, W), the pixel's first row and column in them, samples along its side.
    begins : (4,)
        First fragment of each layer, and the end of the last.
    which
        First triangle of each fragment, and the facets of `find_fragments`.
    shading
        Fragment table and colours.
    """
    owner, row, column, side = samples
    number_of, flat, part_of = which
    table, colour = shading
    one = np.float32(1)
    for s in range(side * side):
        red, green, blue, coverage = np.float32(0), np.float32(0), np.float32(0), np.float32(0)
        for turn in range(3):
            layer = (0, 2, 1)[turn]
            number = owner[layer, row + s // side, column + s % side]
            if number == NO_TRIANGLE:
                continue
            g = begins[layer]
            while not is_same_surface(number, number_of[g], flat, part_of):
                g += 1
            through = one - table[AT_OPACITY, g]
            red, green, blue = (
                red * through + colour[0, g],
                green * through + colour[1, g],
                blue * through + colour[2, g],
            )
            coverage = one - (one - coverage) * through
        total[0], total[1], total[2], total[3] = total[0] + red, total[1] + green, total[2] + blue, total[3] + coverage
    for c in range(4):
        total[c] /= np.float32(side * side)


@kernel
def compose_band(
    owner: Array,
    place: tuple[int, int, int],
    pixels: tuple[Any, int],
    which: tuple[Any, Any, Any],
    shading: tuple[Any, Any],
    out: tuple[Any, Any],
) -> None:
    """Write the pixels of a band.

    Parameters
    ----------
    place
        The band's first row of samples, its number of rows, samples along a pixel's side.
    pixels
        Pixel table and the number of its valid rows.
    which
        First triangle of each fragment, and the facets of `find_fragments`.
    shading
        Fragment table and colours.
    out
        Picture with the background, written in place, and the tables between 8 bits and linear light.
    """
    first_row, side = place[0], place[2]
    table, colour = shading
    picture, tables = out
    share = np.float32(1) / np.float32(side * side)
    total = np.zeros(4, np.float32)
    for p in range(pixels[1]):
        row = pixels[0][p]
        begin, end = row[PIXEL_ENDS], row[PIXEL_ENDS + 3]
        total[0] = total[1] = total[2] = total[3] = np.float32(0)
        if row[PIXEL_ENDS + 1] < end:
            samples = (owner, row[PIXEL_Y] * side - first_row, row[PIXEL_X] * side, side)
            mix_samples(samples, row[PIXEL_ENDS:], which, shading, total)
        else:
            for g in range(begin, end):
                weight = table[AT_SHARE, g] * share
                for c in range(3):
                    total[c] += colour[c, g] * weight
                total[3] += weight
        write_pixel(total, tables, picture, row[PIXEL_X], row[PIXEL_Y])
