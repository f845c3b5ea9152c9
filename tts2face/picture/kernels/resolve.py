"""Compositing of fragments into pixels: layers over each other and over the background, encoded as sRGB."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.numeric.kernels import inlined_kernel, kernel
from tts2face.picture.kernels.fragments import PIXEL_ENDS, PIXEL_X, PIXEL_Y, is_same_surface
from tts2face.picture.kernels.raster import NO_TRIANGLE
from tts2face.picture.kernels.tables import AT_OPACITY, AT_SHARE

Array = NDArray[Any]


@inlined_kernel
def write_pixel(light: tuple[Any, Any, Any], cover: Any, tables: tuple[Any, Any], picture: Array, at: Any) -> None:
    """Composite light and coverage over a pixel (y, x); a picture of four channels stores the coverage."""
    linear, encoded = tables
    y, x = at
    one, zero, half = np.float32(1), np.float32(0), np.float32(0.5)
    top = np.float32(len(encoded) - 1)
    behind, scale = one - cover, one
    if picture.shape[2] == 4:
        picture[y, x, 3] = np.uint8(min(cover, one) * np.float32(255) + half)
        behind, scale = zero, one / max(cover, np.float32(1e-6))
    red, green, blue = light[0] * scale, light[1] * scale, light[2] * scale
    if behind != zero:
        red += behind * linear[picture[y, x, 0]]
        green += behind * linear[picture[y, x, 1]]
        blue += behind * linear[picture[y, x, 2]]
    picture[y, x, 0] = encoded[int(min(max(red, zero), one) * top + half)]
    picture[y, x, 1] = encoded[int(min(max(green, zero), one) * top + half)]
    picture[y, x, 2] = encoded[int(min(max(blue, zero), one) * top + half)]


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
        for `tts2face.picture.kernels.fragments.find_fragments`.
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
    rows, n_pixels = pixels
    edges = samples[2]
    table, colour, through, strands = shading
    picture, tables = out
    one, zero = np.float32(1), np.float32(0)
    n_samples = side * side
    share = one / np.float32(n_samples)
    total, nothing = np.zeros(4, np.float32), np.zeros(0, np.float32)
    for p in range(n_pixels):
        begin, end = rows[p, PIXEL_ENDS], rows[p, PIXEL_ENDS + 3]
        x, y = rows[p, PIXEL_X], rows[p, PIXEL_Y]
        r = y - first_row // side
        red, green, blue, rest, least = zero, zero, zero, one, one
        if through.size > 0:
            rest, least = zero, through[r, x, 0]
            for s in range(n_samples):
                rest += through[r, x, s]
                least = min(least, through[r, x, s])
            rest /= np.float32(n_samples)
            if least < one:
                red, green, blue = strands[r, x, 0], strands[r, x, 1], strands[r, x, 2]
        is_mixed = least < one and (edges[r, x] != 0 or end > begin + 1)
        if end == begin or (not is_mixed and end == begin + 1):  # hair only, or all samples alike
            cover = one - rest
            for g in range(begin, end):
                weight = table[AT_SHARE, g] * share * rest
                red, green, blue = (
                    red + colour[0, g] * weight,
                    green + colour[1, g] * weight,
                    blue + colour[2, g] * weight,
                )
                cover += weight * table[AT_OPACITY, g]
            write_pixel((red, green, blue), cover, tables, picture, (y, x))
        elif is_mixed or rows[p, PIXEL_ENDS + 1] < end:
            total[0], total[1], total[2], total[3] = red, green, blue, zero
            begins = (rows[p, PIXEL_ENDS:], through[r, x] if is_mixed else nothing)
            mix_samples(samples, (r, x, side), which, (table, colour, begins), total)
            write_pixel((total[0], total[1], total[2]), total[3], tables, picture, (y, x))
        else:
            cover = zero
            for g in range(begin, end):
                weight = table[AT_SHARE, g] * share
                red, green, blue = (
                    red + colour[0, g] * weight,
                    green + colour[1, g] * weight,
                    blue + colour[2, g] * weight,
                )
                cover += weight
            write_pixel((red, green, blue), cover, tables, picture, (y, x))
