"""Compositing of fragments into pixels: layers over each other and over the background, encoded as sRGB."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.compilation import inlined_kernel, kernel
from tts2face.render.fragment_rows import AT_OPACITY, AT_SHARE
from tts2face.render.fragments import PIXEL_ENDS, PIXEL_X, PIXEL_Y, is_same_surface
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
    samples: tuple[Any, Any, Any],
    place: tuple[int, int, int],
    which: tuple[Any, Any, Any],
    shading: tuple[Any, Any, Any],
    total: Array,
) -> None:
    """Add the mean over a pixel's samples of the composited layers: light and coverage (4,).

    Parameters
    ----------
    samples
        Visible triangles of samples and of the centres of pixels, and the marks of pixels whose samples are valid, as
        for `tts2face.render.fragments.find_fragments`.
    place
        The pixel's row and column in the band, and samples along its side.
    which
        First triangle of each fragment, and the facets of `find_fragments`.
    shading
        Fragment table, colours, and the first fragment of each layer (4,).
    """
    owner, centres, edges = samples
    r, x, side = place
    number_of, flat, part_of = which
    table, colour, (begins, through) = shading
    one = np.float32(1)
    for s in range(side * side):
        red, green, blue, coverage = np.float32(0), np.float32(0), np.float32(0), np.float32(0)
        passing = through[s] if len(through) > 0 else one
        for turn in range(3):
            layer = (0, 2, 1)[turn]
            if begins[layer] == begins[layer + 1]:
                continue
            if edges[r, x]:
                number = owner[layer, r * side + s // side, x * side + s % side]
            else:
                number = centres[layer, r + 1, x]
            if number == NO_TRIANGLE:
                continue
            g = begins[layer]
            while not is_same_surface(number, number_of[g], flat, part_of):
                g += 1
            behind = one - table[AT_OPACITY, g]
            red, green, blue = red * behind + colour[0, g], green * behind + colour[1, g], blue * behind + colour[2, g]
            coverage = one - (one - coverage) * behind
        share = passing / np.float32(side * side)
        total[0], total[1], total[2] = total[0] + red * share, total[1] + green * share, total[2] + blue * share
        total[3] += one / np.float32(side * side) - share * (one - coverage)


@inlined_kernel
def mean_and_least(values: Array) -> tuple[Any, Any]:
    """Mean and least of a few values."""
    total, least = np.float32(0), values[0]
    for s in range(len(values)):
        total += values[s]
        least = min(least, values[s])
    return total / np.float32(len(values)), least


@kernel
def compose_band(
    samples: tuple[Any, Any, Any],
    place: tuple[int, int, int],
    pixels: tuple[Any, int],
    which: tuple[Any, Any, Any],
    shading: tuple[Any, Any, Any, Any],
    out: tuple[Any, Any],
) -> None:
    """Write the pixels of a band.

    Parameters
    ----------
    samples
        As for `mix_samples`.
    place
        The band's first row of samples, its number of rows, samples along a pixel's side.
    pixels
        Pixel table and the number of its valid rows.
    which
        First triangle of each fragment, and the facets of `find_fragments`.
    shading
        Fragment table, colours, and the passing light and the colour of strands, of size 0 without.
    out
        Picture with the background, written in place, and the tables between 8 bits and linear light.
    """
    first_row, side = place[0], place[2]
    table, colour, through, strands = shading
    picture, tables = out
    share = np.float32(1) / np.float32(side * side)
    total, nothing = np.zeros(4, np.float32), np.zeros(0, np.float32)
    for p in range(pixels[1]):
        row = pixels[0][p]
        begin, end = row[PIXEL_ENDS], row[PIXEL_ENDS + 3]
        r, x = row[PIXEL_Y] - first_row // side, row[PIXEL_X]
        total[0] = total[1] = total[2] = total[3] = np.float32(0)
        passing, rest = nothing, np.float32(1)
        if through.size > 0:
            rest, least = mean_and_least(through[r, x])
            if least < np.float32(1):
                if samples[2][r, x] or end > begin + 1:
                    passing = through[r, x]
                for c in range(3):
                    total[c] = strands[r, x, c]
        if end == begin or (len(passing) == 0 and end == begin + 1):  # hair only, or all samples alike
            total[3] = np.float32(1) - rest
            for g in range(begin, end):
                weight = table[AT_SHARE, g] * share * rest
                for c in range(3):
                    total[c] += colour[c, g] * weight
                total[3] += weight * table[AT_OPACITY, g]
        elif len(passing) > 0 or row[PIXEL_ENDS + 1] < end:
            begins = (row[PIXEL_ENDS:], passing)
            mix_samples(samples, (r, x, side), which, (table, colour, begins), total)
        else:
            for g in range(begin, end):
                weight = table[AT_SHARE, g] * share
                for c in range(3):
                    total[c] += colour[c, g] * weight
                total[3] += weight
        write_pixel(total, tables, picture, x, row[PIXEL_Y])
