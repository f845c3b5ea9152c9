"""Hair, lashes and brows: textured cards, blended from front to back before the surface behind them is shaded.

Each sample of a pixel has the share of light that still passes; a card in front of the sample's surface takes its part
of it. Where nothing passes, cards and surfaces behind are not drawn.

Light of hair, lashes and brows: diffuse light at the vertices of cards, highlights at each pixel.

Highlights follow Kajiya and Kay 1989, with the two shifted highlights of Marschner et al. 2003 as in Scheuermann 2004.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.numeric.kernels import inlined_kernel, kernel, vectorized_kernel
from tts2face.picture.kernels.shade import kept_hue, tone_curve
from tts2face.picture.kernels.tables import FIRST_LIGHT_ROW, FLOOR_ROW, NORMAL, SKY_ROW, UP_ROW
from tts2face.picture.textures import mip_level, read_texel

Array = NDArray[Any]

# Columns of the strand table: place in the picture in samples, 1/z, texture coordinates, diffuse light, and for the key
# light and the first rim light: tangent and normal along the half vector, and how much of the light arrives.
AT_X, AT_Y, AT_NEAR, AT_U, AT_V, AT_LIGHT, AT_LOBES = 0, 1, 2, 3, 4, 5, 8
N_STRAND_COLUMNS = 14
N_FRAGMENT_ROWS, FRAGMENTS_AT_ONCE = 16, 2048 + 80  # the table stays in the cache; rows do not start in one set of it
SHINING_LAMPS = (0, 2)  # lamps with highlights on hair: key, first rim
FIRST_SHIFT, SECOND_SHIFT = np.float32(-0.08), np.float32(0.14)  # of the highlights along the normal
TEXTURE_SHIFT = np.float32(0.12)  # further shift by the brightness of the texture: highlights follow the strands
FIRST_STRENGTH, SECOND_STRENGTH = np.float32(0.05), np.float32(0.72)  # colourless, and of the hair's own colour
CARD_NORMAL = np.float32(0.55)  # share of the card's normal; the rest points away from the middle of the skull


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


@vectorized_kernel
def shade_strands(fragments: Any, n: int, strands: Any, lights: Array, colour: Array) -> None:
    """Add the display light of n fragments of strands to the pixels (R, W, 3).

    Parameters
    ----------
    fragments
        Triangle, row and column of the pixel of each (3, H); rows of numbers (N_FRAGMENT_ROWS, H): albedo, shift of the
        highlights, weights of the second and third corner, and share of the pixel; the others are buffers.
    strands
        Strand table (S, N_STRAND_COLUMNS), triangles (F, 3) and the strength of their highlights (F,).
    """
    which, rows = fragments
    table, triangles, gloss = strands
    one, zero = np.float32(1), np.float32(0)
    for i in range(n):
        t = which[0, i]
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        wb, wc = rows[4, i], rows[5, i]
        wa = one - wb - wc
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
            narrow, wide = max(one - first * first, zero), max(one - second * second, zero)
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
            light[i] = (scale[i] * light[i] + (one - kept[i]) * tone_curve(light[i])) * share[i]
        for i in range(n):
            colour[which[1, i], which[2, i], k] += light[i]


FADE_BEHIND, FADE_SCALE = np.float32(0.9996), np.float32(1200.0)  # cards fade over 0.6 mm where they enter a surface
SMOOTH_TEXELS = np.float32(2.0)  # coarser levels than for skin: one strand is narrower than a pixel and flickers
LEAST_COVERAGE = np.float32(0.03)
SOLID = np.float32(1 / 40)  # passing light below which a sample is full
TILE_PX = 8  # pixels along a side of the tiles in which cards behind everything are skipped


@kernel
def row_range(plane: Array, low: Any, high: Any, limits: tuple[Any, Any]) -> tuple[Any, Any]:
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
def border_cover(weight: float, slope: float) -> Any:
    """Share of a pixel within a half plane with a barycentric weight at its centre, by the slope of `widen_planes`."""
    inside = np.float32(1) if weight >= np.float32(0) else np.float32(0)
    return (
        inside if slope == np.float32(0) else min(max(weight * slope + np.float32(0.5), np.float32(0)), np.float32(1))
    )


@inlined_kernel
def fade_in(near: float, behind: float) -> Any:
    """Visible share of a card with 1/z `near` before a surface with 1/z `behind`, 0 without a surface."""
    fade = np.float32(1)
    if behind > np.float32(0):
        fade = min(max((near - behind * FADE_BEHIND) * FADE_SCALE / behind, np.float32(0)), np.float32(1))
    return fade


@kernel
def visible_share(place: tuple[int, int, int, int], plane: Array, depth: Array, through: Array, passing: Array) -> Any:
    """Write how much of each sample of a pixel shows a card (S,), and return the mean.

    Parameters
    ----------
    place
        Row and column of the pixel in the band, the band's first row of samples, samples along a pixel's side.
    plane : (3,)
        1/z of the card as a function of the place in the picture in samples.
    depth : (R, W)
        1/z of the samples.
    """
    r, x, first_row, side = place
    total = np.float32(0)
    for s in range(side * side):
        row, column = r * side + s // side, x * side + s % side
        px, py = np.float32(column + 0.5), np.float32(row + first_row + 0.5)
        passing[s] = fade_in(plane[0] * px + plane[1] * py + plane[2], depth[row, column]) * through[s]
        total += passing[s]
    return total / np.float32(side * side)


@kernel
def widen_planes(planes: Array, borders: Array, side: int, wide: Array, slopes: Array) -> None:
    """Write the half planes (3, 3) moved out by half a pixel at borders of cards, and the slopes (3,) of coverage.

    The coverage of a pixel at a border is a half plus its distance in pixels from it; `slopes` is 0 elsewhere.
    """
    for e in range(3):
        length = np.sqrt(planes[e, 0] * planes[e, 0] + planes[e, 1] * planes[e, 1]) * np.float32(side)
        slopes[e] = np.float32(1) / max(length, np.float32(1e-9)) if borders[e] else np.float32(0)
        for k in range(3):
            wide[e, k] = planes[e, k]
        if borders[e]:
            wide[e, 2] += np.float32(0.5) * length


@kernel
def find_open_tiles(near: Array, tiles: Array, n_open: Array) -> None:
    """Write for each tile the least 1/z of its pixels' surface, 0 where one shows none, and its number of pixels."""
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


@kernel
def draw_strands(strands: Any, order: Array, scene: Any, band: Any, fragments: Any, out: tuple[Any, Any]) -> None:
    """Blend the cards of a band of pixels.

    Parameters
    ----------
    strands
        Strand table (S, N_STRAND_COLUMNS), triangles (F, 3) as rows of it, whether the edge opposite to each corner is
        a card's border (F, 3), texture and gloss of each triangle (F,) and (F,), mean light of the textures (T,).
    order : (F,)
        Triangles from front to back.
    scene
        Texels, levels, linear table, lights.
    band
        First row of samples, samples along a pixel's side, 1/z of the samples (R, W) and of the centres of pixels
        (R / side + 2, W / side), and the marks of pixels whose samples are valid.
    fragments
        Buffers of `shade_strands`.
    out
        Share of light that passes before each sample (R, W, side * side), set to 1, and the display light of the
        strands as a share of the pixel (R, W, 3), set to 0.
    """
    through, colour = out
    table, triangles, borders, texture, gloss, mean_light = strands
    texels, levels, linear, lights = scene
    first_row, side, depth, centres, edges = band
    one, zero = np.float32(1), np.float32(0)
    n_rows, width, n_samples = through.shape
    planes, passing = np.zeros((4, 3), np.float32), np.zeros(n_samples, np.float32)
    wide, slopes = np.zeros((3, 3), np.float32), np.zeros(3, np.float32)
    reach = np.float32(0.5 * side)
    n = 0
    which, rows = fragments
    is_open = np.ones((n_rows, width), np.uint8)
    tiles = np.zeros(((n_rows + TILE_PX - 1) // TILE_PX, (width + TILE_PX - 1) // TILE_PX), np.float32)
    n_open = np.zeros(tiles.shape, np.int32)
    find_open_tiles(centres, tiles, n_open)
    top_px = first_row // side
    for t in order:
        a, b, c = table[triangles[t, 0]], table[triangles[t, 1]], table[triangles[t, 2]]
        first = max(int(np.floor((min(a[AT_Y], b[AT_Y], c[AT_Y]) - reach) / side)) - top_px, 0)
        last = min(int(np.floor((max(a[AT_Y], b[AT_Y], c[AT_Y]) + reach) / side)) - top_px, n_rows - 1)
        left = max(int(np.floor((min(a[AT_X], b[AT_X], c[AT_X]) - reach) / side)), 0)
        right = min(int(np.floor((max(a[AT_X], b[AT_X], c[AT_X]) + reach) / side)), width - 1)
        if first > last or left > right:
            continue
        if is_behind((first, last, left, right), max(a[AT_NEAR], b[AT_NEAR], c[AT_NEAR]), tiles, n_open):
            continue
        area = set_planes(a, b, c, planes)
        if area == 0.0:
            continue
        widen_planes(planes, borders[t], side, wide, slopes)
        b_x, b_y, b_0, c_x, c_y, c_0 = (
            planes[1, 0],
            planes[1, 1],
            planes[1, 2],
            planes[2, 0],
            planes[2, 1],
            planes[2, 2],
        )
        near_x, near_y, near_0 = planes[3, 0], planes[3, 1], planes[3, 2]
        u1, v1, u2, v2 = b[AT_U] - a[AT_U], b[AT_V] - a[AT_V], c[AT_U] - a[AT_U], c[AT_V] - a[AT_V]
        number = texture[t]
        size = np.float32(levels[number, 0, 1] * levels[number, 0, 2] * side * side)
        level = mip_level(SMOOTH_TEXELS * abs((u1 * v2 - u2 * v1) / area) * size, levels.shape[1])
        place = (levels[number, level, 0], levels[number, level, 1], levels[number, level, 2])
        for r in range(first, last + 1):
            py = np.float32((r + top_px + 0.5) * side)
            least, most = row_range(wide, py, py, (zero, np.float32(width * side)))
            for x in range(max(int(least) // side, left), min(int(most) // side, right) + 1):  # slivers reach far
                if is_open[r, x] == 0:
                    continue
                px = np.float32((x + 0.5) * side)
                wb = b_0 + b_x * px + b_y * py
                wc = c_0 + c_x * px + c_y * py
                wa = one - wb - wc
                cover = border_cover(wa, slopes[0]) * border_cover(wb, slopes[1]) * border_cover(wc, slopes[2])
                if cover <= zero:
                    continue
                if edges[r, x] == 0:
                    seen = fade_in(near_0 + near_x * px + near_y * py, centres[r + 1, x]) * through[r, x, 0]
                    passing[0] = seen
                else:
                    seen = visible_share((r, x, first_row, side), planes[3], depth, through[r, x], passing)
                seen *= cover
                wb = min(max(wb, zero), one)
                wc = min(max(wc, zero), one - wb)
                if seen <= np.float32(2e-3):
                    continue
                red, green, blue, coverage = read_texel(
                    texels, place, linear, a[AT_U] + wb * u1 + wc * u2, a[AT_V] + wb * v1 + wc * v2
                )
                if coverage < LEAST_COVERAGE:
                    continue
                shift = (red + green + blue) * np.float32(1 / 3) / mean_light[number] - one
                shift = min(max(shift, -one), one) * TEXTURE_SHIFT
                if n == which.shape[1]:
                    shade_strands(fragments, n, (table, triangles, gloss), lights, colour)
                    n = 0
                which[0, n], which[1, n], which[2, n] = t, r, x
                rows[0, n], rows[1, n], rows[2, n] = red, green, blue
                rows[3, n], rows[4, n], rows[5, n], rows[6, n] = shift, wb, wc, seen * coverage
                n += 1
                rest = zero
                if edges[r, x] == 0:
                    rest = through[r, x, 0] - passing[0] * coverage * cover
                    for s in range(n_samples):
                        through[r, x, s] = rest
                else:
                    for s in range(n_samples):
                        through[r, x, s] -= passing[s] * coverage * cover
                        rest = max(rest, through[r, x, s])
                if rest < SOLID:
                    is_open[r, x] = 0
                    n_open[r // TILE_PX, x // TILE_PX] -= 1
    if n:
        shade_strands(fragments, n, (table, triangles, gloss), lights, colour)
