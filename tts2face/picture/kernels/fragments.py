"""Fragments of a band of pixels: the samples of a pixel merged where they lie on one smooth surface.

Lighting one fragment instead of its samples takes a third of the time of full supersampling.
"""

from typing import NamedTuple

import numpy as np

from tts2face.numeric.arrays import Array
from tts2face.numeric.kernels import UNIT, ZERO, kernel
from tts2face.picture.kernels.eyes import light_eye
from tts2face.picture.kernels.raster import NO_TRIANGLE
from tts2face.picture.kernels.tables import (
    AT_ALBEDO,
    AT_DIFFUSE,
    AT_EXPOSURE,
    AT_GLOSS,
    AT_GLOW,
    AT_NORMAL,
    AT_RAY,
    AT_SHARE,
    COLOUR,
    DIFFUSE,
    EXPOSURE,
    EYE,
    N_EXPOSURES,
    NORMAL,
    OPEN_SURFACE,
    TEXTURE,
    UV,
)
from tts2face.picture.textures import mip_level, read_texel

MIN_NORMAL_COSINE = np.float32(0.85)  # least cosine between the normals of samples that are merged
HIDDEN_SHARE = np.float32(1 / 512)  # light that passes strands below which nothing behind them is drawn
BACK_LIGHT_SHARE = np.float32(0.3)  # share of the light that reaches the back of a closed part
PIXEL_X, PIXEL_Y, PIXEL_ENDS = 0, 1, 2  # columns of the pixel table; from 2 on: begin, then the end of each layer


class Band(NamedTuple):
    """A band of rows of samples.

    First row of samples, its number of rows, and samples along a pixel's side; visible triangles of the samples
    (3, R, W), as `tts2face.picture.kernels.raster.draw_band` writes them; the share of light that passes strands before
    each sample, and the strands' colour, (R / side, W / side, side * side) and (R / side, W / side, 3), of size 0
    without strands.
    """

    first_row: int
    n_rows: int
    side: int
    owner: Array
    through: Array
    strand_colour: Array


class Facets(NamedTuple):
    """Normals of the triangles (F, 3) and part of each (F,)."""

    normals: Array
    part_of: Array


class Fragments(NamedTuple):
    """Fragments of a band.

    First triangle of each (G,), sums over its samples of column, row and 1 (G, 3), its attributes (N_ROWS, G) by the
    rows of `tts2face.picture.kernels.tables`, its light (3, G); and the pixels that are not empty (P, 6): x, y, first
    fragment, end of the fragments of each layer.
    """

    number_of: Array
    spread: Array
    table: Array
    colour: Array
    pixels: Array


class Materials(NamedTuple):
    """Constants of fragments.

    Triangles (F, 3), part of each (F,), materials (P, 9), texels and levels of `tts2face.picture.textures`, linear
    light of 8 bits (256,), and eyes (E, N_EYE_COLUMNS) of `tts2face.picture.kernels.eyes`.
    """

    triangles: Array
    part_of: Array
    materials: Array
    texels: Array
    levels: Array
    linear: Array
    eyes: Array


@kernel
def face_normals(vertex: Array, triangles: Array, normals: Array) -> None:
    """Write normals (F, 3) of triangles in camera space, each of a length of twice the triangle's area."""
    for t in range(len(triangles)):
        a, b, c = np.uint64(triangles[t, 0]), np.uint64(triangles[t, 1]), np.uint64(triangles[t, 2])
        ux, uy, uz = vertex[b, 0] - vertex[a, 0], vertex[b, 1] - vertex[a, 1], vertex[b, 2] - vertex[a, 2]
        vx, vy, vz = vertex[c, 0] - vertex[a, 0], vertex[c, 1] - vertex[a, 1], vertex[c, 2] - vertex[a, 2]
        normals[t, 0], normals[t, 1], normals[t, 2] = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx


@kernel
def vertex_normals(flat: Array, starts: Array, members: Array, vertex: Array) -> None:
    """Write unit vertex normals: the normalised sum over the triangles ``members[starts[v]:starts[v + 1]]``."""
    for v in range(len(vertex)):
        x, y, z = np.float32(0), np.float32(0), np.float32(0)
        for i in range(starts[v], starts[v + 1]):
            t = np.uint64(members[np.uint64(i)])
            x, y, z = x + flat[t, 0], y + flat[t, 1], z + flat[t, 2]
        scale = np.float32(1) / np.sqrt(x * x + y * y + z * z + np.float32(1e-20))
        vertex[v, NORMAL], vertex[v, NORMAL + 1], vertex[v, NORMAL + 2] = x * scale, y * scale, z * scale


@kernel
def is_same_surface(number: int, other: int, facets: Facets) -> bool:
    """Whether two visible triangles lie on one smooth surface: same part, same side, similar normals."""
    if (number < 0) != (other < 0):
        return number == other
    t, u = (number, other) if number >= 0 else (~number, ~other)
    flat, part_of = facets.normals, facets.part_of
    cosine = flat[t, 0] * flat[u, 0] + flat[t, 1] * flat[u, 1] + flat[t, 2] * flat[u, 2]
    squared = flat[t, 0] ** 2 + flat[t, 1] ** 2 + flat[t, 2] ** 2
    squared *= flat[u, 0] ** 2 + flat[u, 1] ** 2 + flat[u, 2] ** 2
    smooth = (
        (cosine > 0) & (cosine * cosine > MIN_NORMAL_COSINE * MIN_NORMAL_COSINE * squared) & (part_of[t] == part_of[u])
    )
    return bool(smooth | (t == u))


@kernel
def find_fragments(band: Band, n_layers: int, facets: Facets, fragments: Fragments) -> int:
    """Write triangles, samples and pixels of the fragments of a band; returns the number of pixels."""
    side = band.side
    owner = band.owner
    through = band.through
    number_of = fragments.number_of
    spread = fragments.spread
    pixels = fragments.pixels
    n_fragments = n_pixels = 0
    n_samples = side * side
    middle = 0.5 * (side - 1)
    for r in range(band.n_rows // side):
        for x in range(owner.shape[2] // side):
            start = n_fragments
            seen = UNIT
            if through.size > 0:
                seen = np.float32(0)
                for s in range(n_samples):
                    seen = max(seen, through[r, x, s])
            if seen < HIDDEN_SHARE:
                for layer in range(4):
                    pixels[n_pixels, PIXEL_ENDS + layer] = start
                pixels[n_pixels, PIXEL_X], pixels[n_pixels, PIXEL_Y] = x, r + band.first_row // side
                n_pixels += 1
                continue
            for layer in range(n_layers):
                first = n_fragments
                pixels[n_pixels, PIXEL_ENDS + layer] = first
                last, g = NO_TRIANGLE, first
                number, is_one = owner[layer, r * side, x * side], True
                for row in range(r * side, r * side + side):
                    for column in range(x * side, x * side + side):
                        is_one &= owner[layer, row, column] == number
                if is_one:  # as the loops, written out
                    if number != NO_TRIANGLE:
                        number_of[n_fragments] = number
                        spread[n_fragments, 0] = n_samples * (x * side + middle)
                        spread[n_fragments, 1] = n_samples * (r * side + band.first_row + middle)
                        spread[n_fragments, 2] = n_samples
                        n_fragments += 1
                    continue
                for row in range(r * side, r * side + side):
                    for column in range(x * side, x * side + side):
                        number = owner[layer, row, column]
                        if number == NO_TRIANGLE:
                            continue
                        if number != last:
                            last, g = number, first
                            while g < n_fragments and not is_same_surface(number, number_of[g], facets):
                                g += 1
                        if g == n_fragments:
                            n_fragments += 1
                            number_of[g] = number
                            spread[g, 0] = spread[g, 1] = spread[g, 2] = np.float32(0)
                        spread[g, 0] += np.float32(column)
                        spread[g, 1] += np.float32(row + band.first_row)
                        spread[g, 2] += UNIT
            if n_fragments > start or seen < UNIT:
                for layer in range(n_layers, 4):
                    pixels[n_pixels, PIXEL_ENDS + layer] = n_fragments
                pixels[n_pixels, PIXEL_X], pixels[n_pixels, PIXEL_Y] = x, r + band.first_row // side
                n_pixels += 1
    return n_pixels


@kernel
def evaluate_fragments(
    fragments: Fragments, n_fragments: int, vertex: Array, scene: Materials, lens: Array, side: int
) -> None:
    """Write attributes of fragments, interpolated at the centre of their samples (Moeller and Trumbore 1997)."""
    number_of = fragments.number_of
    spread = fragments.spread
    table = fragments.table
    triangles = scene.triangles
    part_of = scene.part_of
    materials = scene.materials
    eyes = scene.eyes
    texels = scene.texels
    levels = scene.levels
    linear = scene.linear
    focal, middle_x, middle_y = np.float32(1 / lens[0]), np.float32(lens[1] - 0.5), np.float32(lens[2] - 0.5)
    pixel = np.float32((side / lens[0]) ** 2)
    sx = sy = sz = e1x = e1y = e1z = e2x = e2y = e2z = rx = ry = rz = ZERO
    ua = va = u1 = v1 = u2 = v2 = texel_area = ZERO
    last = NO_TRIANGLE
    a = 0
    b = 0
    c = 0
    material = 0
    texture = -1
    for g in range(n_fragments):
        number = number_of[g]
        if number != last:  # fragments of one triangle often follow each other
            last = number
            t = number if number >= 0 else ~number
            a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
            sx, sy, sz = -vertex[a, 0], -vertex[a, 1], -vertex[a, 2]
            e1x, e1y, e1z = vertex[b, 0] + sx, vertex[b, 1] + sy, vertex[b, 2] + sz
            e2x, e2y, e2z = vertex[c, 0] + sx, vertex[c, 1] + sy, vertex[c, 2] + sz
            rx, ry, rz = sy * e1z - sz * e1y, sz * e1x - sx * e1z, sx * e1y - sy * e1x
            material = part_of[t]
            texture = int(materials[material, TEXTURE])
            if texture >= 0:
                ua, va = vertex[a, UV], vertex[a, UV + 1]
                u1, v1, u2, v2 = vertex[b, UV] - ua, vertex[b, UV + 1] - va, vertex[c, UV] - ua, vertex[c, UV + 1] - va
                texel_area = abs(u1 * v2 - u2 * v1)
                texel_area *= np.float32(levels[texture, 0, 1]) * np.float32(levels[texture, 0, 2])
        share = UNIT / spread[g, 2]
        dx, dy = (spread[g, 0] * share - middle_x) * focal, (spread[g, 1] * share - middle_y) * focal
        qx, qy, qz = dy * e2z - e2y, e2x - dx * e2z, dx * e2y - dy * e2x
        determinant = e1x * qx + e1y * qy + e1z * qz
        inverse = UNIT / determinant if determinant != ZERO else ZERO
        wb = min(max((sx * qx + sy * qy + sz * qz) * inverse, ZERO), UNIT)
        wc = min(max((dx * rx + dy * ry + rz) * inverse, ZERO), UNIT - wb)
        wa = UNIT - wb - wc
        for k in range(3):
            n, d = NORMAL + k, DIFFUSE + k
            table[AT_NORMAL + k, g] = wa * vertex[a, n] + wb * vertex[b, n] + wc * vertex[c, n]
            table[AT_DIFFUSE + k, g] = wa * vertex[a, d] + wb * vertex[b, d] + wc * vertex[c, d]
        if texture >= 0:
            level = mip_level(texel_area * pixel * sz * sz * abs(inverse), levels.shape[1])
            place = (levels[texture, level, 0], levels[texture, level, 1], levels[texture, level, 2])
            red, green, blue, _ = read_texel(texels, place, linear, ua + wb * u1 + wc * u2, va + wb * v1 + wc * v2)
            table[AT_ALBEDO, g], table[AT_ALBEDO + 1, g], table[AT_ALBEDO + 2, g] = red, green, blue
        else:
            for k in range(COLOUR, COLOUR + 3):
                table[AT_ALBEDO + k - COLOUR, g] = wa * vertex[a, k] + wb * vertex[b, k] + wc * vertex[c, k]
        for k in range(N_EXPOSURES):
            e = EXPOSURE + k
            table[AT_EXPOSURE + k, g] = wa * vertex[a, e] + wb * vertex[b, e] + wc * vertex[c, e]
        table[AT_RAY, g], table[AT_RAY + 1, g] = dx, dy
        for k in range(5):
            table[AT_GLOSS + k, g] = materials[material, k]
        table[AT_GLOW, g], table[AT_SHARE, g] = ZERO, spread[g, 2]
        if number < 0:
            turn_back(table, g, materials[material, OPEN_SURFACE] == ZERO)
        if materials[material, EYE] > ZERO and len(eyes) > 0:
            depth = -sz + wb * e1z + wc * e2z
            light_eye(eyes, (dx * depth, dy * depth, depth), g, table)


@kernel
def turn_back(table: Array, g: int, is_closed: bool) -> None:
    """Turn the normal of a fragment that shows the back of its triangle; the inside of a closed part is dark."""
    for k in range(3):
        table[AT_NORMAL + k, g] *= np.float32(-1)
    if is_closed:
        for k in range(3):
            table[AT_DIFFUSE + k, g] *= BACK_LIGHT_SHARE
        for k in range(N_EXPOSURES):
            table[AT_EXPOSURE + k, g] *= BACK_LIGHT_SHARE
