"""From fragments to pixels: layers over each other and over the background, encoded as sRGB."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.render.compiled import kernel
from tts2face.render.fragments import (
    AT_OPACITY,
    AT_SHARE,
    PIXEL_ENDS,
    PIXEL_X,
    PIXEL_Y,
    evaluate,
    face_normals,
    find_hits,
    join,
    vertex_normals,
)
from tts2face.render.raster import NOTHING, draw_band, gather, sort_into_bands, to_camera
from tts2face.render.shade import light

Array = NDArray[Any]


@kernel
def write_pixel(total: Array, tables: tuple[Any, Any], picture: Array, x: int, y: int) -> None:
    """Lay light and coverage (4,) over the pixel that is there; with four channels, keep the coverage."""
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
    samples: tuple[Any, int, int, int], begins: Array, hits: Any, shown: tuple[Any, Any], total: Array
) -> None:
    """Write the mean over a pixel's samples of the layers over each other: light and coverage (4,).

    Parameters
    ----------
    samples
        Owner (3, R, W), the pixel's first row and column in it, samples along its side.
    begins : (4,)
        First hit of each layer, and the end.
    shown
        Fragment table and colours.
    """
    owner, row, column, side = samples
    number_of, fragment_of = hits[0], hits[3]
    table, colour = shown
    one = np.float32(1)
    for s in range(side * side):
        red, green, blue, coverage = np.float32(0), np.float32(0), np.float32(0), np.float32(0)
        for turn in range(3):
            layer = (0, 2, 1)[turn]
            number = owner[layer, row + s // side, column + s % side]
            if number == NOTHING:
                continue
            h = begins[layer]
            while number_of[h] != number:
                h += 1
            g = fragment_of[h]
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
def compose(
    owner: Array,
    place: tuple[int, int],
    pixels: tuple[Any, int],
    hits: Any,
    shown: tuple[Any, Any],
    out: tuple[Any, Any],
) -> None:
    """Write the pixels of a band.

    Parameters
    ----------
    place
        The band's first row of samples, samples along a pixel's side.
    pixels
        Pixel table and how many of its rows count.
    shown
        Fragment table and colours.
    out
        The picture, holding the background, and the tables between 8 bits and linear light.
    """
    first_row, side = place
    table, colour = shown
    picture, tables = out
    share = np.float32(1) / np.float32(side * side)
    total = np.zeros(4, np.float32)
    g = 0
    for p in range(pixels[1]):
        row = pixels[0][p]
        begin, end = row[PIXEL_ENDS], row[PIXEL_ENDS + 3]
        total[:] = 0
        if row[PIXEL_ENDS + 1] < end:
            samples = (owner, row[PIXEL_Y] * side - first_row, row[PIXEL_X] * side, side)
            mix_samples(samples, row[PIXEL_ENDS:], hits, shown, total)
        else:
            for g in range(hits[3][begin], hits[3][end - 1] + 1):
                weight = table[AT_SHARE, g] * share
                for c in range(3):
                    total[c] += colour[c, g] * weight
                total[3] += weight
        write_pixel(total, tables, picture, row[PIXEL_X], row[PIXEL_Y])


@kernel
def paint(points: Array, surface: Any, optics: Any, light_of: Any, scratch: Any, picture: Array) -> None:
    """Draw one picture over the background that it holds.

    Parameters
    ----------
    points : (V, 3)
        The face in the world, mm.
    surface
        Triangles, marks of translucent ones, (part of triangle, materials, texture), neighbour starts and members.
    optics
        View (3, 4), lens (4,), samples along a pixel's side.
    light_of
        Lights (L, 6), (linear table, encoding table).
    scratch
        As `tts2face.render.draw` makes it; its vertex table holds exposure, colour and uv.
    picture : (H, W, 3) or (H, W, 4)
        sRGB, with coverage.
    """
    triangles, translucent, materials, starts, members = surface
    view, lens, side = optics
    lights, tables = light_of
    vertex, grid, flat, corners, source, band_starts, band_members, depth, owner, hits, table, pixels = scratch
    band_rows = depth.shape[1]
    height, width = picture.shape[0] * side, picture.shape[1] * side
    to_camera(points, view, lens, vertex, grid)
    face_normals(vertex, triangles, flat)
    vertex_normals(flat, starts, members, vertex)
    count = gather(vertex, grid, triangles, (lens, (width, height)), corners, source)
    sort_into_bands(corners, count, band_rows, band_starts, band_members)
    if band_starts[-1] > len(band_members):
        band_members = np.zeros(band_starts[-1], np.int32)
        sort_into_bands(corners, count, band_rows, band_starts, band_members)
    scene = (triangles, materials[0], materials[1], materials[2], tables[0])
    fragment, ambient, colour = table
    for band in range(len(band_starts) - 1):
        if band_starts[band] == band_starts[band + 1]:
            continue
        first_row = band * band_rows
        rows = min(band_rows, height - first_row)
        batch = (corners, source, band_members[band_starts[band] : band_starts[band + 1]])
        here = owner[:, :rows]
        n_translucent = draw_band((vertex, triangles, translucent, lens), batch, first_row, depth[:, :rows], here)
        n_pixels = find_hits(here, 3 if n_translucent else 1, (first_row, side), hits, pixels)
        if n_pixels == 0:
            continue
        evaluate(hits, pixels[n_pixels - 1, PIXEL_ENDS + 3], vertex, scene, lens, fragment)
        n_fragments = join(fragment, hits, pixels, n_pixels)
        light(fragment, n_fragments, lights, ambient, colour)
        compose(here, (first_row, side), (pixels, n_pixels), hits, (fragment, colour), (picture, tables))
