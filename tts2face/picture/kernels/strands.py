"""Hair, lashes and brows: textured cards, blended from front to back before the surface behind them is shaded.

Each sample of a pixel has the share of light that still passes; a card in front of the sample's surface takes its part
of it. Where nothing passes, cards and surfaces behind are not drawn.
"""

from typing import Any, NamedTuple

import numpy as np

from tts2face.numeric.arrays import Array
from tts2face.numeric.kernels import UNIT, ZERO, inlined_kernel, kernel
from tts2face.picture.kernels.strand_light import (
    AT_NEAR,
    AT_U,
    AT_V,
    AT_X,
    AT_Y,
    Cards,
    StrandFragments,
    shade_strands,
)
from tts2face.picture.textures import mip_level, read_texel

FRAGMENTS_AT_ONCE = 2048 + 80  # the table stays in the cache; rows do not start in one set of it
TEXTURE_SHIFT = np.float32(0.12)  # further shift by the brightness of the texture: highlights follow the strands
FADE_BEHIND, FADE_SCALE = np.float32(0.9996), np.float32(1200.0)  # cards fade over 0.6 mm where they enter a surface
SMOOTH_TEXELS = np.float32(2.0)  # coarser levels than for skin: one strand is narrower than a pixel and flickers
LEAST_COVERAGE = np.float32(0.03)
SOLID = np.float32(1 / 40)  # passing light below which a sample is full
TILE_PX = 8  # pixels along a side of the tiles in which cards behind everything are skipped


class StrandScene(NamedTuple):
    """Texels and levels of the textures, linear light of 8 bits, and the light table."""

    texels: Array
    levels: Array
    linear: Array
    lights: Array


class Covered(NamedTuple):
    """A band of pixels that strands cover.

    First row of samples, samples along a pixel's side, 1/z of the samples (R, W); the share of light that passes before
    each sample (R / side, W / side, side * side), set to 1, and the display light of the strands as a share of the
    pixel (R / side, W / side, 3), set to 0.
    """

    first_row: int
    side: int
    depth: Array
    through: Array
    colour: Array


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
    before = (near - behind * FADE_BEHIND) * FADE_SCALE
    return np.float32(1) if before >= behind else max(before / behind, np.float32(0))


@inlined_kernel
def visible_share(band: Covered, r: int, x: int, plane: Array, passing: Array) -> Any:
    """Write how much of each sample of a pixel (row, column) shows a card (S,), and return the mean.

    `plane` (3,) is 1/z of the card as a function of the place in the picture in samples.
    """
    side, total = band.side, np.float32(0)
    for s in range(side * side):
        row, column = r * side + s // side, x * side + s % side
        px, py = np.float32(column + 0.5), np.float32(row + band.first_row + 0.5)
        near = plane[0] * px + plane[1] * py + plane[2]
        passing[s] = fade_in(near, band.depth[row, column]) * band.through[r, x, s]
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
def find_open_tiles(depth: Array, side: int, tiles: Array, n_open: Array) -> None:
    """Write for each tile the least 1/z of its samples (R, W), 0 where one shows nothing, and its number of pixels."""
    reach = TILE_PX * side
    for r in range(tiles.shape[0]):
        for x in range(tiles.shape[1]):
            least, count = np.float32(np.inf), 0
            for row in range(r * reach, min((r + 1) * reach, depth.shape[0])):
                for column in range(x * reach, min((x + 1) * reach, depth.shape[1])):
                    least, count = min(least, depth[row, column]), count + 1
            tiles[r, x], n_open[r, x] = least, count // (side * side)


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
def draw_strands(cards: Cards, order: Array, scene: StrandScene, band: Covered, fragments: StrandFragments) -> None:
    """Blend the cards of a band of pixels; `order` (F,) are their triangles from front to back."""
    table = cards.table
    triangles = cards.triangles
    through = band.through
    texels, levels = scene.texels, scene.levels
    first_row, side = band.first_row, band.side
    which, rows = fragments.which, fragments.rows
    n_rows, width, n_samples = through.shape
    planes, passing = np.zeros((4, 3), np.float32), np.zeros(n_samples, np.float32)
    wide, slopes = np.zeros((3, 3), np.float32), np.zeros(3, np.float32)
    reach = np.float32(0.5 * side)
    n = 0
    is_open = np.ones((n_rows, width), np.uint8)
    tiles = np.zeros(((n_rows + TILE_PX - 1) // TILE_PX, (width + TILE_PX - 1) // TILE_PX), np.float32)
    n_open = np.zeros(tiles.shape, np.int32)
    find_open_tiles(band.depth, side, tiles, n_open)
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
        widen_planes(planes, cards.borders[t], side, wide, slopes)
        b_x, b_y, b_0 = planes[1, 0], planes[1, 1], planes[1, 2]
        c_x, c_y, c_0 = planes[2, 0], planes[2, 1], planes[2, 2]
        u1, v1, u2, v2 = b[AT_U] - a[AT_U], b[AT_V] - a[AT_V], c[AT_U] - a[AT_U], c[AT_V] - a[AT_V]
        number = cards.texture[t]
        size = np.float32(levels[number, 0, 1] * levels[number, 0, 2] * side * side)
        level = mip_level(SMOOTH_TEXELS * abs((u1 * v2 - u2 * v1) / area) * size, levels.shape[1])
        place = (levels[number, level, 0], levels[number, level, 1], levels[number, level, 2])
        for r in range(first, last + 1):
            py = np.float32((r + top_px + 0.5) * side)
            least, most = row_range(wide, py, py, (ZERO, np.float32(width * side)))
            for x in range(max(int(least) // side, left), min(int(most) // side, right) + 1):  # slivers reach far
                if is_open[r, x] == 0:
                    continue
                px = np.float32((x + 0.5) * side)
                wb = b_0 + b_x * px + b_y * py
                wc = c_0 + c_x * px + c_y * py
                wa = UNIT - wb - wc
                cover = border_cover(wa, slopes[0]) * border_cover(wb, slopes[1]) * border_cover(wc, slopes[2])
                if cover <= ZERO:
                    continue
                seen = visible_share(band, r, x, planes[3], passing) * cover
                wb = min(max(wb, ZERO), UNIT)
                wc = min(max(wc, ZERO), UNIT - wb)
                if seen <= np.float32(2e-3):
                    continue
                red, green, blue, coverage = read_texel(
                    texels, place, scene.linear, a[AT_U] + wb * u1 + wc * u2, a[AT_V] + wb * v1 + wc * v2
                )
                if coverage < LEAST_COVERAGE:
                    continue
                shift = (red + green + blue) * np.float32(1 / 3) / cards.mean_light[number] - UNIT
                shift = min(max(shift, -UNIT), UNIT) * TEXTURE_SHIFT
                if n == which.shape[1]:
                    shade_strands(fragments, n, cards, scene.lights, band.colour)
                    n = 0
                which[0, n], which[1, n], which[2, n] = t, r, x
                rows[0, n], rows[1, n], rows[2, n] = red, green, blue
                rows[3, n], rows[4, n], rows[5, n], rows[6, n] = shift, wb, wc, seen * coverage
                n += 1
                rest = ZERO
                for s in range(n_samples):
                    through[r, x, s] -= passing[s] * coverage * cover
                    rest = max(rest, through[r, x, s])
                if rest < SOLID:
                    is_open[r, x] = 0
                    n_open[r // TILE_PX, x // TILE_PX] -= 1
    if n:
        shade_strands(fragments, n, cards, scene.lights, band.colour)
