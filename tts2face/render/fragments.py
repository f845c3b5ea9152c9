"""Fragments of a band of pixels: the samples of a pixel merged where they lie on one smooth surface.

Lighting one fragment instead of its samples takes a third of the time of full supersampling.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.compilation import kernel
from tts2face.render.raster import NO_TRIANGLE

Array = NDArray[Any]

MIN_NORMAL_COSINE = np.float32(0.85)  # least cosine between the normals of samples that are merged
BACK_LIGHT_SHARE = np.float32(0.3)  # share of the light that reaches the back of a closed part
SPECULAR, SHININESS, WRAP, OPACITY, TEXTURED, OPEN_SURFACE = range(6)  # columns of the material table
CAMERA, NORMAL, EXPOSURE, COLOUR, UV = 0, 3, 6, 10, 13  # columns of the vertex table: 3, 3, 4, 3, 2 numbers
N_VERTEX_COLUMNS = 16  # one cache line
# Rows of the fragment table: normal 3, albedo 3, exposure 4, ray 2, material 4, share of the pixel.
AT_NORMAL, AT_ALBEDO, AT_EXPOSURE, AT_RAY, AT_SPECULAR, AT_SHININESS, AT_WRAP, AT_OPACITY, AT_SHARE = (
    0, 3, 6, 10, 12, 13, 14, 15, 16,
)  # fmt: skip
N_ROWS = 17
PIXEL_X, PIXEL_Y, PIXEL_ENDS = 0, 1, 2  # columns of the pixel table; from 2 on: begin, then the end of each layer


@kernel
def face_normals(vertex: Array, triangles: Array, normals: Array) -> None:
    """Write normals (F, 3) of triangles in camera space, each of a length of twice the triangle's area."""
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        ux, uy, uz = vertex[b, 0] - vertex[a, 0], vertex[b, 1] - vertex[a, 1], vertex[b, 2] - vertex[a, 2]
        vx, vy, vz = vertex[c, 0] - vertex[a, 0], vertex[c, 1] - vertex[a, 1], vertex[c, 2] - vertex[a, 2]
        normals[t, 0], normals[t, 1], normals[t, 2] = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx


@kernel
def vertex_normals(flat: Array, starts: Array, members: Array, vertex: Array) -> None:
    """Write unit vertex normals: the normalised sum over the triangles ``members[starts[v]:starts[v + 1]]``."""
    for v in range(len(vertex)):
        x, y, z = np.float32(0), np.float32(0), np.float32(0)
        for i in range(starts[v], starts[v + 1]):
            t = members[i]
            x, y, z = x + flat[t, 0], y + flat[t, 1], z + flat[t, 2]
        scale = np.float32(1) / np.sqrt(x * x + y * y + z * z + np.float32(1e-20))
        vertex[v, NORMAL], vertex[v, NORMAL + 1], vertex[v, NORMAL + 2] = x * scale, y * scale, z * scale


@kernel
def is_same_surface(number: int, other: int, flat: Array, part_of: Array) -> bool:
    """Whether two visible triangles lie on one smooth surface: same part, same side, similar normals."""
    if (number < 0) != (other < 0):
        return number == other
    t, u = (number, other) if number >= 0 else (~number, ~other)
    cosine = flat[t, 0] * flat[u, 0] + flat[t, 1] * flat[u, 1] + flat[t, 2] * flat[u, 2]
    squared = flat[t, 0] ** 2 + flat[t, 1] ** 2 + flat[t, 2] ** 2
    squared *= flat[u, 0] ** 2 + flat[u, 1] ** 2 + flat[u, 2] ** 2
    smooth = (
        (cosine > 0) & (cosine * cosine > MIN_NORMAL_COSINE * MIN_NORMAL_COSINE * squared) & (part_of[t] == part_of[u])
    )
    return bool(smooth | (t == u))


@kernel
def find_fragments(
    owner: Array, n_layers: int, place: tuple[int, int, int], facets: tuple[Any, Any], found: Any, pixels: Array
) -> int:
    """Find the fragments of each pixel of a band; returns the number of pixels that are not empty.

    Parameters
    ----------
    owner : (3, R, W)
        Visible triangle of each sample and layer, as `draw_band` writes it.
    place
        The band's first row of samples, its number of rows, samples along a pixel's side.
    facets
        Normals of the triangles (F, 3) and part of each (F,).
    found
        Out, for each fragment: its first triangle (G,); sums over its samples of column, row and 1 (G, 3).
    pixels : (P, 6)
        Out: x, y, first fragment, end of the fragments of each layer.
    """
    first_row, n_rows, side = place
    number_of, spread = found
    flat, part_of = facets
    n_fragments = n_pixels = 0
    one = np.float32(1)
    for r in range(0, n_rows, side):
        for x in range(0, owner.shape[2], side):
            begin = n_fragments
            for layer in range(n_layers):
                first = n_fragments
                pixels[n_pixels, PIXEL_ENDS + layer] = first
                number = owner[layer, r, x]
                n_same = 0
                for row in range(r, r + side):
                    for column in range(x, x + side):
                        n_same += owner[layer, row, column] == number
                if n_same == side * side:
                    if number != NO_TRIANGLE:
                        number_of[n_fragments] = number
                        spread[n_fragments, 0] = (x + 0.5 * (side - 1)) * n_same
                        spread[n_fragments, 1] = (r + first_row + 0.5 * (side - 1)) * n_same
                        spread[n_fragments, 2] = n_same
                        n_fragments += 1
                    continue
                last, g = NO_TRIANGLE, first
                for row in range(r, r + side):
                    for column in range(x, x + side):
                        number = owner[layer, row, column]
                        if number == NO_TRIANGLE:
                            continue
                        if number != last:
                            last, g = number, first
                            while g < n_fragments and not is_same_surface(number, number_of[g], flat, part_of):
                                g += 1
                        if g == n_fragments:
                            n_fragments += 1
                            number_of[g] = number
                            spread[g, 0] = spread[g, 1] = spread[g, 2] = np.float32(0)
                        spread[g, 0] += np.float32(column)
                        spread[g, 1] += np.float32(row + first_row)
                        spread[g, 2] += one
            if n_fragments > begin:
                for layer in range(n_layers, 4):
                    pixels[n_pixels, PIXEL_ENDS + layer] = n_fragments
                pixels[n_pixels, PIXEL_X], pixels[n_pixels, PIXEL_Y] = x // side, (r + first_row) // side
                n_pixels += 1
    return n_pixels


@kernel
def texel(texture: Array, linear: Array, u: float, v: float, c: int) -> Any:
    """Bilinear value of channel `c` of a texture at (u, v), in linear light."""
    height, width = texture.shape[0], texture.shape[1]
    one, half, zero = np.float32(1), np.float32(0.5), np.float32(0)
    x = min(max(u * np.float32(width) - half, zero), np.float32(width - 1))
    y = min(max(v * np.float32(height) - half, zero), np.float32(height - 1))
    left, top = int(x), int(y)
    right, below = min(left + 1, width - 1), min(top + 1, height - 1)
    across, along = x - np.float32(left), y - np.float32(top)
    upper = linear[texture[top, left, c]] * (one - across) + linear[texture[top, right, c]] * across
    lower = linear[texture[below, left, c]] * (one - across) + linear[texture[below, right, c]] * across
    return upper * (one - along) + lower * along


@kernel
def evaluate_fragments(found: Any, n_fragments: int, vertex: Array, scene: Any, lens: Array, table: Array) -> None:
    """Interpolate vertex attributes at the centre of each fragment's samples (Moeller and Trumbore 1997).

    Parameters
    ----------
    scene
        Triangles (F, 3), part of each (F,), materials (P, 6), texture (H, W, 3), linear table (256,).
    table : (17, G)
        Out: the attributes in the rows named at the top of this module.
    """
    number_of, spread = found
    triangles, part_of, materials, texture, linear = scene
    one, zero = np.float32(1), np.float32(0)
    focal, middle_x, middle_y = np.float32(1 / lens[0]), np.float32(lens[1] - 0.5), np.float32(lens[2] - 0.5)
    for g in range(n_fragments):
        number = number_of[g]
        t = number if number >= 0 else ~number
        share = one / spread[g, 2]
        dx, dy = (spread[g, 0] * share - middle_x) * focal, (spread[g, 1] * share - middle_y) * focal
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        sx, sy, sz = -vertex[a, 0], -vertex[a, 1], -vertex[a, 2]
        e1x, e1y, e1z = vertex[b, 0] + sx, vertex[b, 1] + sy, vertex[b, 2] + sz
        e2x, e2y, e2z = vertex[c, 0] + sx, vertex[c, 1] + sy, vertex[c, 2] + sz
        qx, qy, qz = dy * e2z - e2y, e2x - dx * e2z, dx * e2y - dy * e2x
        determinant = e1x * qx + e1y * qy + e1z * qz
        inverse = one / determinant if determinant != zero else zero
        rx, ry, rz = sy * e1z - sz * e1y, sz * e1x - sx * e1z, sx * e1y - sy * e1x
        wb = min(max((sx * qx + sy * qy + sz * qz) * inverse, zero), one)
        wc = min(max((dx * rx + dy * ry + rz) * inverse, zero), one - wb)
        wa = one - wb - wc
        for k in range(3):
            n, o = NORMAL + k, COLOUR + k
            table[AT_NORMAL + k, g] = wa * vertex[a, n] + wb * vertex[b, n] + wc * vertex[c, n]
            table[AT_ALBEDO + k, g] = wa * vertex[a, o] + wb * vertex[b, o] + wc * vertex[c, o]
        material = part_of[t]
        if materials[material, TEXTURED] != zero:
            u = wa * vertex[a, UV] + wb * vertex[b, UV] + wc * vertex[c, UV]
            v = wa * vertex[a, UV + 1] + wb * vertex[b, UV + 1] + wc * vertex[c, UV + 1]
            for k in range(3):
                table[AT_ALBEDO + k, g] = texel(texture, linear, u, v, k)
        turn = one if number >= 0 else -one
        inner = BACK_LIGHT_SHARE if number < 0 and materials[material, OPEN_SURFACE] == zero else one
        for k in range(3):
            table[AT_NORMAL + k, g] *= turn
        for k in range(4):
            mean = wa * vertex[a, EXPOSURE + k] + wb * vertex[b, EXPOSURE + k] + wc * vertex[c, EXPOSURE + k]
            table[AT_EXPOSURE + k, g] = mean * inner
        table[AT_RAY, g], table[AT_RAY + 1, g] = dx, dy
        for k in range(4):
            table[AT_SPECULAR + k, g] = materials[material, k]
        table[AT_SHARE, g] = spread[g, 2]
