"""Hair, lashes and brows: textured cards, blended from front to back before the surface behind them is shaded.

Each sample of a pixel has the share of light that still passes; a card in front of the sample's surface takes its part
of it. Where nothing passes, cards and surfaces behind are not drawn. Light is computed at the vertices, highlights for
each pixel (Kajiya and Kay 1989, with the two shifted highlights of Marschner et al. 2003 as in Scheuermann 2004).
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.compilation import inlined_kernel, kernel, vectorized_kernel
from tts2face.render.fragment_rows import NORMAL
from tts2face.render.shade import tone_curve
from tts2face.render.studio_light import FIRST_LIGHT_ROW, FLOOR_ROW, SKY_ROW, UP_ROW
from tts2face.render.textures import mip_level, read_texel

Array = NDArray[Any]

# Columns of the strand table: place in the picture in samples, 1/z, texture coordinates, diffuse light, and for the key
# light and the first rim light: tangent and normal along the half vector, and how much of the light arrives.
AT_X, AT_Y, AT_NEAR, AT_U, AT_V, AT_LIGHT, AT_LOBES = 0, 1, 2, 3, 4, 5, 8
N_STRAND_COLUMNS = 14
SHINING_LAMPS = (0, 2)  # lamps with highlights on hair: key, first rim
FIRST_SHIFT, SECOND_SHIFT = np.float32(-0.08), np.float32(0.14)  # of the highlights along the normal
TEXTURE_SHIFT = np.float32(0.12)  # further shift by the brightness of the texture: highlights follow the strands
FIRST_STRENGTH, SECOND_STRENGTH = np.float32(0.055), np.float32(0.80)  # colourless, and of the hair's own colour
FADE_BEHIND, FADE_SCALE = np.float32(0.9996), np.float32(1200.0)  # cards fade over 0.6 mm where they enter a surface
LEAST_COVERAGE = np.float32(0.03)
SOLID = np.float32(1 / 40)  # passing light below which a sample is full
TILE_PX = 8  # pixels along a side of the tiles in which cards behind everything are skipped
CARD_NORMAL = np.float32(0.55)  # share of the card's normal; the rest points away from the middle of the skull


@vectorized_kernel
def light_strands(vertices: Array, normals: Array, tangents: Array, light: Any, vertex: Array, table: Array) -> None:
    """Write the light of the vertices of strands.

    Parameters
    ----------
    vertices : (S,)
        Their rows in the vertex table.
    normals, tangents : (S, 3)
        In camera space, unit length; normals point away from the skull.
    light
        Exposure (V, 5), light table (7, 6) of `tts2face.render.shade`, lens.
    table : (S, N_STRAND_COLUMNS)
        Out: all columns but the texture coordinates.
    """
    exposure, lights, lens = light
    zero, one, half = np.float32(0), np.float32(1), np.float32(0.5)
    for i in range(len(vertices)):
        v = vertices[i]
        px, py, pz = vertex[v, 0], vertex[v, 1], vertex[v, 2]
        depth = max(pz, np.float32(lens[3]))
        table[i, AT_X], table[i, AT_Y] = lens[1] + lens[0] * px / depth, lens[2] + lens[0] * py / depth
        table[i, AT_NEAR] = one / depth if pz >= lens[3] else zero
        nx, ny, nz = vertex[v, NORMAL], vertex[v, NORMAL + 1], vertex[v, NORMAL + 2]
        ox, oy, oz = normals[i, 0], normals[i, 1], normals[i, 2]
        turn = CARD_NORMAL if nx * ox + ny * oy + nz * oz > zero else -CARD_NORMAL
        nx, ny, nz = turn * nx + half * ox, turn * ny + half * oy, turn * nz + half * oz
        scale = one / np.sqrt(nx * nx + ny * ny + nz * nz + np.float32(1e-9))
        nx, ny, nz = nx * scale, ny * scale, nz * scale
        tx, ty, tz = tangents[i, 0], tangents[i, 1], tangents[i, 2]
        scale = -one / np.sqrt(px * px + py * py + pz * pz + np.float32(1e-9))
        wx, wy, wz = px * scale, py * scale, pz * scale
        up = nx * lights[UP_ROW, 0] + ny * lights[UP_ROW, 1] + nz * lights[UP_ROW, 2]
        for c in range(3):
            middle = half * (lights[SKY_ROW, c] + lights[FLOOR_ROW, c])
            swing = half * (lights[SKY_ROW, c] - lights[FLOOR_ROW, c])
            table[i, AT_LIGHT + c] = np.float32(1.4) * (middle + swing * up) * exposure[v, 0]
        column = AT_LOBES
        for k in range(len(lights) - FIRST_LIGHT_ROW):
            lx, ly, lz = lights[FIRST_LIGHT_ROW + k, 0], lights[FIRST_LIGHT_ROW + k, 1], lights[FIRST_LIGHT_ROW + k, 2]
            seen = exposure[v, 1 + k]
            facing, along = nx * lx + ny * ly + nz * lz, tx * lx + ty * ly + tz * lz
            sine = np.sqrt(max(one - along * along, zero))
            matt = np.float32(0.55) * sine * max(np.float32(0.25) + np.float32(0.75) * facing, zero)
            matt = (matt + np.float32(0.45) * max(facing, zero)) * seen
            for c in range(3):
                table[i, AT_LIGHT + c] += matt * lights[FIRST_LIGHT_ROW + k, 3 + c]
            if k == SHINING_LAMPS[0] or k == SHINING_LAMPS[1]:
                hx, hy, hz = lx + wx, ly + wy, lz + wz
                scale = one / np.sqrt(hx * hx + hy * hy + hz * hz + np.float32(1e-9))
                table[i, column] = (tx * hx + ty * hy + tz * hz) * scale
                table[i, column + 1] = (nx * hx + ny * hy + nz * hz) * scale
                table[i, column + 2] = min(max(np.float32(1.6) * facing + np.float32(0.35), zero), one) * seen
                column += 3


@inlined_kernel
def power_8(value: float) -> Any:
    """Eighth power."""
    value *= value
    value *= value
    return value * value


@vectorized_kernel
def strand_light(weights: tuple[float, float, float], rows: Any, albedo: Array, lights: Array, gloss: tuple[float, float],
                 light: Array) -> None:
    """Write the display light (3,) of strands at a point between three rows of the strand table.

    `gloss` is the shift of the highlights by the texture, and their strength.
    """
    wa, wb, wc = weights
    a, b, c = rows
    zero, one = np.float32(0), np.float32(1)
    for k in range(3):
        light[k] = albedo[k] * (wa * a[AT_LIGHT + k] + wb * b[AT_LIGHT + k] + wc * c[AT_LIGHT + k])
    for lamp in range(2):
        o = AT_LOBES + 3 * lamp
        tangent, normal = wa * a[o] + wb * b[o] + wc * c[o], wa * a[o + 1] + wb * b[o + 1] + wc * c[o + 1]
        arrives = (wa * a[o + 2] + wb * b[o + 2] + wc * c[o + 2]) * gloss[1]
        first = tangent + (gloss[0] + FIRST_SHIFT) * normal
        second = tangent + (gloss[0] + SECOND_SHIFT) * normal
        narrow = power_8(max(one - first * first, zero))
        narrow *= narrow
        narrow *= narrow * FIRST_STRENGTH * arrives
        wide = power_8(max(one - second * second, zero)) * SECOND_STRENGTH * arrives
        row = FIRST_LIGHT_ROW + SHINING_LAMPS[lamp]
        for k in range(3):
            light[k] += lights[row, 3 + k] * (narrow + wide * albedo[k])
    for k in range(3):
        light[k] = tone_curve(light[k])


@vectorized_kernel
def row_range(plane: Array, low: float, high: float, limits: tuple[float, float]) -> tuple[float, float]:
    """Range of x within `limits` where three half planes (3, 3), a x + b y + c >= 0, hold for some y in a range."""
    least, most = limits
    for e in range(3):
        rest = plane[e, 2] + max(plane[e, 1] * low, plane[e, 1] * high)
        if plane[e, 0] > 0:
            least = max(least, -rest / plane[e, 0])
        elif plane[e, 0] < 0:
            most = min(most, rest / -plane[e, 0])
        elif rest < 0:
            return 1.0, 0.0
    return least, most


@inlined_kernel
def fade_in(near: float, behind: float) -> Any:
    """Visible share of a card with 1/z `near` before a surface with 1/z `behind`, 0 without a surface."""
    fade = np.float32(1)
    if behind > np.float32(0):
        fade = min(max((near - behind * FADE_BEHIND) * FADE_SCALE / behind, np.float32(0)), np.float32(1))
    return fade


@vectorized_kernel
def visible_share(place: tuple[int, int, int, int], planes: Array, depth: Any, through: Array, passing: Array) -> Any:
    """Write how much of each sample of a pixel shows a triangle (S,), and return the mean.

    Parameters
    ----------
    place
        Row and column of the pixel in the band, the band's first row of samples, samples along a pixel's side.
    planes : (4, 3)
        The half planes of the triangle, and its 1/z, as functions of the place in the picture in samples.
    depth
        1/z of the samples (R, W), or one value for all.
    """
    r, x, first_row, side = place
    zero = np.float32(0)
    total = zero
    for s in range(side * side):
        row, column = r * side + s // side, x * side + s % side
        px, py = np.float32(column + 0.5), np.float32(row + first_row + 0.5)
        passing[s] = zero
        if through[s] < SOLID:
            continue
        if (
            planes[0, 0] * px + planes[0, 1] * py + planes[0, 2] < zero
            or planes[1, 0] * px + planes[1, 1] * py + planes[1, 2] < zero
            or planes[2, 0] * px + planes[2, 1] * py + planes[2, 2] < zero
        ):
            continue
        near = planes[3, 0] * px + planes[3, 1] * py + planes[3, 2]
        behind = depth[1] if depth[1] >= zero else depth[0][row, column]
        passing[s] = fade_in(near, behind) * through[s]
        total += passing[s]
    return total / np.float32(side * side)


@kernel
def find_open_tiles(near: Array, tiles: Array, n_open: Array) -> None:
    """Write for each tile of pixels the least 1/z of its surface, 0 where a pixel shows none, and its number of pixels."""
    for r in range(tiles.shape[0]):
        for x in range(tiles.shape[1]):
            least, count = np.float32(np.inf), 0
            for row in range(r * TILE_PX, min((r + 1) * TILE_PX, near.shape[0] - 2)):
                for column in range(x * TILE_PX, min((x + 1) * TILE_PX, near.shape[1])):
                    least, count = min(least, near[row + 1, column]), count + 1
            tiles[r, x], n_open[r, x] = least, count


@kernel
def is_behind(box: tuple[int, int, int, int], nearest: float, tiles: Array, n_open: Array) -> bool:
    """Whether a card within a box of pixels (first row, last row, first column, last column) cannot be seen."""
    for r in range(box[0] // TILE_PX, box[1] // TILE_PX + 1):
        for x in range(box[2] // TILE_PX, box[3] // TILE_PX + 1):
            if n_open[r, x] > 0 and tiles[r, x] * FADE_BEHIND < nearest:
                return False
    return True


@inlined_kernel
def plane_margins(planes: Array, reach: float) -> tuple[float, float, float]:
    """How far the half planes change within `reach` samples along both axes."""
    return (
        (abs(planes[0, 0]) + abs(planes[0, 1])) * reach,
        (abs(planes[1, 0]) + abs(planes[1, 1])) * reach,
        (abs(planes[2, 0]) + abs(planes[2, 1])) * reach,
    )


@kernel
def set_planes(a: Array, b: Array, c: Array, planes: Array) -> float:
    """Write the half planes of a triangle and its 1/z; returns twice its area, 0 if it is not drawn."""
    area = (b[AT_X] - a[AT_X]) * (c[AT_Y] - a[AT_Y]) - (c[AT_X] - a[AT_X]) * (b[AT_Y] - a[AT_Y])
    if abs(area) < np.float32(1e-3) or min(a[AT_NEAR], b[AT_NEAR], c[AT_NEAR]) <= np.float32(0):
        return 0.0
    inverse = np.float32(1) / area
    planes[1, 0], planes[1, 1] = (c[AT_Y] - a[AT_Y]) * inverse, (a[AT_X] - c[AT_X]) * inverse
    planes[2, 0], planes[2, 1] = (a[AT_Y] - b[AT_Y]) * inverse, (b[AT_X] - a[AT_X]) * inverse
    for e in (1, 2):
        planes[e, 2] = -planes[e, 0] * a[AT_X] - planes[e, 1] * a[AT_Y]
    slope_b, slope_c = b[AT_NEAR] - a[AT_NEAR], c[AT_NEAR] - a[AT_NEAR]
    for k in range(3):
        planes[0, k] = -planes[1, k] - planes[2, k]
        planes[3, k] = slope_b * planes[1, k] + slope_c * planes[2, k]
    planes[0, 2] += np.float32(1)
    planes[3, 2] += a[AT_NEAR]
    return float(area)


@vectorized_kernel
def draw_strands(strands: Any, order: Array, scene: Any, band: Any, through: Array, colour: Array) -> None:
    """Blend the cards of a band of pixels.

    Parameters
    ----------
    strands
        Strand table (S, N_STRAND_COLUMNS), triangles (F, 3) as rows of it, texture and gloss of each triangle (F,) and
        (F,), mean light of the textures (T,).
    order : (F,)
        Triangles from front to back.
    scene
        Texels, levels, linear table, lights.
    band
        First row of samples, samples along a pixel's side, 1/z of the samples (R, W) and of the centres of pixels
        (R / side + 2, W / side), and the marks of pixels whose samples are valid.
    through : (R, W, side * side)
        Out: share of light that passes before each sample.
    colour : (R, W, 3)
        Out: display light of the strands, as a share of the pixel.
    """
    table, triangles, texture, gloss, mean_light = strands
    texels, levels, linear, lights = scene
    first_row, side, depth, centres, edges = band
    one, zero = np.float32(1), np.float32(0)
    n_rows, width, n_samples = through.shape
    each = one / np.float32(n_samples)
    planes, passing = np.zeros((4, 3), np.float32), np.zeros(n_samples, np.float32)
    sample, light = np.zeros(4, np.float32), np.zeros(3, np.float32)
    is_open = np.ones((n_rows, width), np.uint8)
    tiles = np.zeros(((n_rows + TILE_PX - 1) // TILE_PX, (width + TILE_PX - 1) // TILE_PX), np.float32)
    n_open = np.zeros(tiles.shape, np.int32)
    find_open_tiles(centres, tiles, n_open)
    top_px = first_row // side
    for t in order:
        a, b, c = table[triangles[t, 0]], table[triangles[t, 1]], table[triangles[t, 2]]
        first = max(int(np.floor(min(a[AT_Y], b[AT_Y], c[AT_Y]) / side)) - top_px, 0)
        last = min(int(np.floor(max(a[AT_Y], b[AT_Y], c[AT_Y]) / side)) - top_px, n_rows - 1)
        left = max(int(np.floor(min(a[AT_X], b[AT_X], c[AT_X]) / side)), 0)
        right = min(int(np.floor(max(a[AT_X], b[AT_X], c[AT_X]) / side)), width - 1)
        if first > last or left > right:
            continue
        if is_behind((first, last, left, right), max(a[AT_NEAR], b[AT_NEAR], c[AT_NEAR]), tiles, n_open):
            continue
        area = set_planes(a, b, c, planes)
        if area == 0.0:
            continue
        margins = plane_margins(planes, np.float32(0.5 * (side - 1)))
        u1, v1, u2, v2 = b[AT_U] - a[AT_U], b[AT_V] - a[AT_V], c[AT_U] - a[AT_U], c[AT_V] - a[AT_V]
        number = texture[t]
        size = np.float32(levels[number, 0, 1] * levels[number, 0, 2] * side * side)
        place = levels[number, mip_level(abs((u1 * v2 - u2 * v1) / area) * size, levels.shape[1])]
        for r in range(first, last + 1):
            low = np.float32((r + top_px) * side) + np.float32(0.5)
            least, most = row_range(planes, low, low + np.float32(side - 1), (zero, np.float32(width * side)))
            py = np.float32((r + top_px + 0.5) * side)
            for x in range(int(least) // side, min(int(most) // side, width - 1) + 1):
                if is_open[r, x] == 0:
                    continue
                px = np.float32((x + 0.5) * side)
                wb = planes[1, 0] * px + planes[1, 1] * py + planes[1, 2]
                wc = planes[2, 0] * px + planes[2, 1] * py + planes[2, 2]
                wa = one - wb - wc
                is_whole = edges[r, x] == 0 and wa >= margins[0] and wb >= margins[1] and wc >= margins[2]
                if is_whole:
                    fade = fade_in(planes[3, 0] * px + planes[3, 1] * py + planes[3, 2], centres[r + 1, x])
                    if fade <= zero:
                        continue
                    seen = zero
                    for s in range(n_samples):
                        passing[s] = fade * through[r, x, s]
                        seen += passing[s]
                    seen *= each
                else:
                    behind = centres[r + 1, x] if edges[r, x] == 0 else -one
                    seen = visible_share((r, x, first_row, side), planes, (depth, behind), through[r, x], passing)
                    wb = min(max(wb, zero), one)
                    wc = min(max(wc, zero), one - wb)
                    wa = one - wb - wc
                if seen <= np.float32(2e-3):
                    continue
                uv = (a[AT_U] + wb * u1 + wc * u2, a[AT_V] + wb * v1 + wc * v2)
                coverage = read_texel(texels, place, linear, uv, sample)
                if coverage < LEAST_COVERAGE:
                    continue
                shift = (sample[0] + sample[1] + sample[2]) * np.float32(1 / 3) / mean_light[number] - one
                shift = min(max(shift, -one), one) * TEXTURE_SHIFT
                strand_light((wa, wb, wc), (a, b, c), sample, lights, (shift, gloss[t]), light)
                for k in range(3):
                    colour[r, x, k] += light[k] * seen * coverage
                rest = zero
                for s in range(n_samples):
                    through[r, x, s] -= passing[s] * coverage
                    rest = max(rest, through[r, x, s])
                if rest < SOLID:
                    is_open[r, x] = 0
                    n_open[r // TILE_PX, x // TILE_PX] -= 1
