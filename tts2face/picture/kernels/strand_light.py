"""Light of hair, lashes and brows: diffuse light at the vertices of cards, highlights at each pixel.

Highlights follow Kajiya and Kay 1989, with the two shifted highlights of Marschner et al. 2003 as in Scheuermann 2004.
"""

from typing import Any, NamedTuple

import numpy as np

from tts2face.numeric.arrays import Array
from tts2face.numeric.kernels import HALF, UNIT, ZERO, kernel, vectorized_kernel
from tts2face.picture.kernels.lamps import FIRST_LIGHT_ROW, FLOOR_ROW, SKY_ROW, UP_ROW
from tts2face.picture.kernels.shade import kept_hue, tone_curve
from tts2face.picture.kernels.tables import NORMAL

# Columns of the strand table: place in the picture in samples, 1/z, texture coordinates, diffuse light, and for the key
# light and the first rim light: tangent and normal along the half vector, and how much of the light arrives.
AT_X, AT_Y, AT_NEAR, AT_U, AT_V, AT_LIGHT, AT_LOBES = 0, 1, 2, 3, 4, 5, 8
N_STRAND_COLUMNS = 14
N_FRAGMENT_ROWS = 16
SHINING_LAMPS = (0, 2)  # lamps with highlights on hair: key, first rim
FIRST_SHIFT, SECOND_SHIFT = np.float32(-0.08), np.float32(0.14)  # of the highlights along the normal
FIRST_STRENGTH, SECOND_STRENGTH = np.float32(0.05), np.float32(0.72)  # colourless, and of the hair's own colour
CARD_NORMAL = np.float32(0.55)  # share of the card's normal; the rest points away from the middle of the skull


class Cards(NamedTuple):
    """Cards of strands in one pose.

    Strand table (S, N_STRAND_COLUMNS), triangles (F, 3) as rows of it, whether the edge opposite to each corner is a
    card's border (F, 3), texture and strength of the highlights of each triangle (F,), mean light of the textures (T,).
    """

    table: Array
    triangles: Array
    borders: Array
    texture: Array
    gloss: Array
    mean_light: Array


class StrandFragments(NamedTuple):
    """Fragments of strands.

    Triangle, row and column of the pixel of each (3, H); numbers (N_FRAGMENT_ROWS, H): albedo, shift of the highlights,
    weights of the second and third corner, and share of the pixel; the others are buffers.
    """

    which: Array
    rows: Array


@kernel
def light_strands(vertices: Array, normals: Array, tangents: Array, light: Any, vertex: Array, table: Array) -> None:
    """Write the light of the vertices of strands.

    Parameters
    ----------
    vertices : (S,)
        Their rows in the vertex table.
    normals, tangents : (S, 3)
        In camera space, unit length; normals point away from the skull.
    light
        Exposure (V, 5), light table (7, 6) of `tts2face.picture.kernels.shade`, lens.
    table : (S, N_STRAND_COLUMNS)
        Out: all columns but the texture coordinates.
    """
    exposure, lights, lens = light
    for i in range(len(vertices)):
        v = vertices[i]
        px, py, pz = vertex[v, 0], vertex[v, 1], vertex[v, 2]
        depth = max(pz, np.float32(lens[3]))
        table[i, AT_X], table[i, AT_Y] = lens[1] + lens[0] * px / depth, lens[2] + lens[0] * py / depth
        table[i, AT_NEAR] = UNIT / depth if pz >= lens[3] else ZERO
        nx, ny, nz = vertex[v, NORMAL], vertex[v, NORMAL + 1], vertex[v, NORMAL + 2]
        ox, oy, oz = normals[i, 0], normals[i, 1], normals[i, 2]
        turn = CARD_NORMAL if nx * ox + ny * oy + nz * oz > ZERO else -CARD_NORMAL
        nx, ny, nz = turn * nx + HALF * ox, turn * ny + HALF * oy, turn * nz + HALF * oz
        scale = UNIT / np.sqrt(nx * nx + ny * ny + nz * nz + np.float32(1e-9))
        nx, ny, nz = nx * scale, ny * scale, nz * scale
        tx, ty, tz = tangents[i, 0], tangents[i, 1], tangents[i, 2]
        scale = -UNIT / np.sqrt(px * px + py * py + pz * pz + np.float32(1e-9))
        wx, wy, wz = px * scale, py * scale, pz * scale
        up = nx * lights[UP_ROW, 0] + ny * lights[UP_ROW, 1] + nz * lights[UP_ROW, 2]
        for c in range(3):
            middle = HALF * (lights[SKY_ROW, c] + lights[FLOOR_ROW, c])
            swing = HALF * (lights[SKY_ROW, c] - lights[FLOOR_ROW, c])
            table[i, AT_LIGHT + c] = np.float32(1.4) * (middle + swing * up) * exposure[v, 0]
        column = AT_LOBES
        for k in range(len(lights) - FIRST_LIGHT_ROW):
            lx, ly, lz = lights[FIRST_LIGHT_ROW + k, 0], lights[FIRST_LIGHT_ROW + k, 1], lights[FIRST_LIGHT_ROW + k, 2]
            seen = exposure[v, 1 + k]
            facing, along = nx * lx + ny * ly + nz * lz, tx * lx + ty * ly + tz * lz
            sine = np.sqrt(max(UNIT - along * along, ZERO))
            matt = np.float32(0.55) * sine * max(np.float32(0.25) + np.float32(0.75) * facing, ZERO)
            matt = (matt + np.float32(0.45) * max(facing, ZERO)) * seen
            for c in range(3):
                table[i, AT_LIGHT + c] += matt * lights[FIRST_LIGHT_ROW + k, 3 + c]
            if k == SHINING_LAMPS[0] or k == SHINING_LAMPS[1]:
                hx, hy, hz = lx + wx, ly + wy, lz + wz
                scale = UNIT / np.sqrt(hx * hx + hy * hy + hz * hz + np.float32(1e-9))
                table[i, column] = (tx * hx + ty * hy + tz * hz) * scale
                table[i, column + 1] = (nx * hx + ny * hy + nz * hz) * scale
                table[i, column + 2] = min(max(np.float32(1.6) * facing + np.float32(0.35), ZERO), UNIT) * seen
                column += 3


@vectorized_kernel
def shade_strands(fragments: StrandFragments, n: int, cards: Cards, lights: Array, colour: Array) -> None:
    """Add the display light of n fragments of strands to the pixels (R, W, 3)."""
    which, rows = fragments.which, fragments.rows
    table = cards.table
    triangles = cards.triangles
    gloss = cards.gloss
    for i in range(n):
        t = which[0, i]
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        wb, wc = rows[4, i], rows[5, i]
        wa = UNIT - wb - wc
        for k in range(AT_LIGHT, N_STRAND_COLUMNS):
            rows[7 + k - AT_LIGHT, i] = wa * table[a, k] + wb * table[b, k] + wc * table[c, k]
        rows[12, i] *= gloss[t]
        rows[15, i] *= gloss[t]
    for k in range(3):
        light, albedo = rows[7 + k], rows[k]
        for i in range(n):
            light[i] *= albedo[i]
    shift = rows[3]
    for lamp in range(2):
        tangent, normal, arrives = rows[10 + 3 * lamp], rows[11 + 3 * lamp], rows[12 + 3 * lamp]
        lamp_row = FIRST_LIGHT_ROW + SHINING_LAMPS[lamp]
        for i in range(n):
            first = tangent[i] + (shift[i] + FIRST_SHIFT) * normal[i]
            second = tangent[i] + (shift[i] + SECOND_SHIFT) * normal[i]
            narrow, wide = max(UNIT - first * first, ZERO), max(UNIT - second * second, ZERO)
            narrow *= narrow
            narrow *= narrow
            narrow *= narrow
            narrow *= narrow
            narrow *= narrow
            wide *= wide
            wide *= wide
            wide *= wide
            tangent[i] = narrow * FIRST_STRENGTH * arrives[i]
            normal[i] = wide * SECOND_STRENGTH * arrives[i]
        for k in range(3):
            light, albedo, strength = rows[7 + k], rows[k], lights[lamp_row, 3 + k]
            for i in range(n):
                light[i] += strength * (tangent[i] + normal[i] * albedo[i])
    share, kept, scale = rows[6], rows[10], rows[11]
    for i in range(n):
        kept[i], scale[i] = kept_hue(rows[7, i], rows[8, i], rows[9, i])
    for k in range(3):
        light = rows[7 + k]
        for i in range(n):
            light[i] = (scale[i] * light[i] + (UNIT - kept[i]) * tone_curve(light[i])) * share[i]
        for i in range(n):
            colour[which[1, i], which[2, i], k] += light[i]
