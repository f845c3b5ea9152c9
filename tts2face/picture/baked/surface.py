"""Surface of a face with baked light in the arrays that the kernels take.

The nearest triangle of each sample: spans of rows, and one integer for depth and triangle.

Every kernel releases the interpreter's lock and runs on one thread; each picture is drawn by one thread, so its bytes
do not depend on the number of threads. Both triangles at an edge compute the same end of their spans and include it,
so that no sample falls between them. Picture space: x right, y down, in samples.

Sums of modes of baked light.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from tts2face.face.deformation import FaceRig, build_rig
from tts2face.models.baked_light import BLACK_SHARE, N_PAGES, BakedLight
from tts2face.models.face import Face
from tts2face.models.light import Lit
from tts2face.numeric.arrays import connected_pieces, decode_srgb
from tts2face.numeric.kernels import BLOCK, flat_view, kernel, vectorized_kernel, write_larger
from tts2face.picture.baked.response import LightTerms, light_terms
from tts2face.processes.shared import shared

Array = NDArray[Any]

X, Y, NEAR, U, V, RED, GREEN, BLUE = range(8)  # columns of a table of projected vertices
N_COLUMNS = 8
TRIANGLE_BITS = 20
MAX_TRIANGLES = (1 << TRIANGLE_BITS) - 2
TRIANGLE_MASK = (1 << TRIANGLE_BITS) - 1  # of the triangle's number plus one in a sample
DEPTH_SCALE = np.float32(2.0**41)  # of 1/z in 1/mm: 43 bits beside the triangle's, from 1 mm to 100 m
AT, COUNT, DEPTH, N_SPAN_VALUES = 0, BLOCK, 2 * BLOCK, 3 * BLOCK  # of the spans of a block of rows, in one array
LEAST_AREA = np.float32(1e-3)  # twice that of a triangle that is drawn, in samples


@kernel
def project(points: Array, source: Array, view: Array, lens: Array, table: Array) -> None:
    """Write columns X, Y and NEAR (1/mm; 0 nearer than the near plane) of the world points (P, 3), mm, of rows (V,).

    `view` (3, 4) transforms world to camera space; `lens` is (focal length in samples, centre x, centre y, near plane).
    Samples have whole coordinates at their centres.
    """
    half, unit = np.float32(0.5), np.float32(1)
    for v in range(len(source)):
        p = source[v]
        x, y, z = points[p, 0], points[p, 1], points[p, 2]
        right = view[0, 0] * x + view[0, 1] * y + view[0, 2] * z + view[0, 3]
        down = view[1, 0] * x + view[1, 1] * y + view[1, 2] * z + view[1, 3]
        ahead = view[2, 0] * x + view[2, 1] * y + view[2, 2] * z + view[2, 3]
        near = unit / ahead if ahead >= lens[3] else np.float32(0)
        table[v, X] = lens[1] + lens[0] * right * near - half
        table[v, Y] = lens[2] + lens[0] * down * near - half
        table[v, NEAR] = near


@kernel
def find_bands(table: Array, triangles: Array, rows: tuple[int, int], bands: Array, counts: Array) -> None:
    """Write the bands of rows that triangles touch, and the number of triangles in each band.

    A band's samples stay in the processor's cache while its triangles are drawn.

    Parameters
    ----------
    table : (V, 8)
        Projected vertices.
    triangles : (F, 3)
        Vertex indices, counter-clockwise as seen.
    rows
        Rows of samples of the picture and of a band.
    bands : (F, 2)
        Out: the first band and the end of the bands; none for a triangle that does not face the camera.
    counts : (B,)
        Out.
    """
    bottom, zero, band_rows = np.float32(rows[0] - 1), np.float32(0), np.uint32(rows[1])
    for band in range(len(counts)):
        counts[band] = 0
    for t in range(len(triangles)):
        a, b, c = np.uint64(triangles[t, 0]), np.uint64(triangles[t, 1]), np.uint64(triangles[t, 2])
        ax, ay, bx, by, cx, cy = table[a, X], table[a, Y], table[b, X], table[b, Y], table[c, X], table[c, Y]
        low, high = np.ceil(max(min(ay, by, cy), zero)), np.floor(min(max(ay, by, cy), bottom))
        shown = ((bx - ax) * (cy - ay) - (cx - ax) * (by - ay) <= -LEAST_AREA) & (low <= high)
        first = np.int64(np.uint32(min(low, bottom)) // band_rows)
        end = np.int64(np.uint32(max(high, zero)) // band_rows) + 1 if shown else first
        bands[t, 0], bands[t, 1] = first, end
        for band in range(first, end):
            counts[band] += 1


@kernel
def fill_bands(bands: Array, ends: Array, order: Array) -> None:
    """Write the numbers (n,) of the triangles of each band one after the other, from the ends (B,) of the bands."""
    for t in range(len(bands) - 1, -1, -1):
        for band in range(bands[t, 0], bands[t, 1]):
            ends[band] -= 1
            order[ends[band]] = t


@kernel
def find_nearest(
    table: Array, triangles: Array, order: Array, first_row: int, nearest: Array, spans: Array
) -> tuple[int, int]:
    """Write the nearest triangle that faces the camera in each sample; returns the columns [first, end) that hold any.

    Parameters
    ----------
    table : (V, 8)
        Projected vertices.
    triangles : (F, 3)
        Vertex indices, counter-clockwise as seen; those with a vertex nearer than the near plane are not drawn.
    order : (n,)
        The triangles that are drawn.
    first_row
        The picture's row of samples that is the first of `nearest`.
    nearest : (H, W + BLOCK) int64
        Out: 1/z in the high bits, the triangle's number plus one in the low ones; the largest wins. 0 where none is.
    spans : (N_SPAN_VALUES,) int64
        Scratch space: the first sample of each span of a triangle, their number, and the value of the first.

    Notes
    -----
    A triangle takes no branch that its shape decides: the processor would guess it wrongly. Its edges are sorted by
    conditional values, `BLOCK` rows have their spans at once, and a span its first `BLOCK` samples, of which few have
    more; spans without any change none.
    """
    height, stride = nearest.shape
    line = flat_view(nearest)
    for sample in range(len(line)):
        line[sample] = 0
    top_row, end_row = np.float32(first_row), np.float32(first_row + height - 1)
    zero, left_end, right_end = np.float32(0), np.float32(0), np.float32(stride - BLOCK - 1)
    beyond = right_end + np.float32(1)
    first_column, last_column = np.float32(stride), np.float32(-1)
    for t in order:
        a, b, c = np.uint64(triangles[t, 0]), np.uint64(triangles[t, 1]), np.uint64(triangles[t, 2])
        ax, ay, bx, by, cx, cy = table[a, X], table[a, Y], table[b, X], table[b, Y], table[c, X], table[c, Y]
        az, bz, cz = table[a, NEAR], table[b, NEAR], table[c, NEAR]
        area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
        low, high = np.ceil(max(min(ay, by, cy), top_row)), np.floor(min(max(ay, by, cy), end_row))
        from_column, to_column = np.ceil(max(min(ax, bx, cx), left_end)), np.floor(min(max(ax, bx, cx), right_end))
        if (area > -LEAST_AREA) | (low > high) | (from_column > to_column) | (min(az, bz, cz) <= 0):
            continue
        first_column, last_column = min(first_column, from_column), max(last_column, to_column)
        inverse = np.float32(1) / area
        across = ((bz - az) * (cy - ay) - (cz - az) * (by - ay)) * inverse
        along = ((cz - az) * (bx - ax) - (bz - az) * (cx - ax)) * inverse
        origin = az - across * ax - along * ay
        step, number = np.int64(across * DEPTH_SCALE) << TRIANGLE_BITS, np.int64(t + 1)
        swap = by < ay
        ax, bx, ay, by = bx if swap else ax, ax if swap else bx, by if swap else ay, ay if swap else by
        swap = cy < by
        bx, cx, by, cy = cx if swap else bx, bx if swap else cx, cy if swap else by, by if swap else cy
        swap = by < ay
        ax, bx, ay, by = bx if swap else ax, ax if swap else bx, by if swap else ay, ay if swap else by
        whole, upper, lower = (cx - ax) / (cy - ay), (bx - ax) / (by - ay), (cx - bx) / (cy - by)
        upper, lower = upper if by > ay else zero, lower if cy > by else zero
        first, n_rows = (int(low) - first_row) * stride, int(high) + 1 - int(low)
        for block in range(0, n_rows, BLOCK):
            for row in range(BLOCK):
                y = low + np.float32(block + row)
                one_side, below = ax + whole * (y - ay), bx + lower * (y - by)
                other = ax + upper * (y - ay) if y < by else below
                left = np.ceil(max(min(one_side, other), left_end))
                right = np.floor(min(max(one_side, other), right_end))
                spans[AT + row] = first + (block + row) * stride + np.int64(min(left, beyond))
                spans[COUNT + row] = np.int64(right) + 1 - np.int64(left)
                depth = np.int64((origin + across * left + along * y) * DEPTH_SCALE)
                spans[DEPTH + row] = depth << TRIANGLE_BITS | number
            for row in range(min(BLOCK, n_rows - block)):
                at, count, depth = spans[AT + row], spans[COUNT + row], spans[DEPTH + row]
                write_larger(nearest, at, count, depth, step)
                while count > BLOCK:
                    at, count, depth = at + BLOCK, count - BLOCK, depth + BLOCK * step
                    write_larger(nearest, at, count, depth, step)
    return int(min(first_column, last_column + 1)), int(last_column) + 1


def nearest_triangles(table: Array, triangles: Array, shape: tuple[int, int]) -> tuple[NDArray[np.int64], int, int]:
    """Samples (H, W + BLOCK) of a whole picture (H, W), and the columns with any, as `find_nearest` writes them."""
    nearest = np.zeros((shape[0], shape[1] + BLOCK), np.int64)
    every, spans = np.arange(len(triangles), dtype=np.int32), np.zeros(N_SPAN_VALUES, np.int64)
    return nearest, *find_nearest(table, triangles, every, 0, nearest, spans)


LIGHT_BITS, LIGHT_MASK = 10, 1023  # of each of the three numbers in a texel of changing light
LIGHT_STEP, LIGHT_ZERO = np.float32(0.5), np.float32(512)  # of 255 a step, and the number of no change
LEAST_WEIGHT = np.float32(1e-4)


@vectorized_kernel
def add_modes(base: Array, modes: Array, weights: Array, out: Array) -> None:
    """Write the sum (N,) of a base (N,) and modes (C, N) by their weights (C,)."""
    for i in range(len(base)):
        out[i] = np.float32(base[i])
    last, zero = len(weights) - 1, np.float32(0)
    for c in range(0, last + 1, 2):  # two at once: the sums are read and written half as often
        d = min(c + 1, last)
        first = weights[c] if abs(weights[c]) >= LEAST_WEIGHT else zero
        second = weights[d] if (d > c) & (abs(weights[d]) >= LEAST_WEIGHT) else zero
        for i in range(len(base)):
            out[i] += first * np.float32(modes[c, i]) + second * np.float32(modes[d, i])


@vectorized_kernel
def pack_change(change: Array, texels: Array) -> None:
    """Write changes of colour (3, N) into texels (N,) of three numbers."""
    half, top = np.float32(0.5), np.float32(LIGHT_MASK)
    per_step = np.float32(1) / LIGHT_STEP
    for i in range(len(texels)):
        red = min(max(change[0, i] * per_step + LIGHT_ZERO + half, np.float32(0)), top)
        green = min(max(change[1, i] * per_step + LIGHT_ZERO + half, np.float32(0)), top)
        blue = min(max(change[2, i] * per_step + LIGHT_ZERO + half, np.float32(0)), top)
        texels[i] = np.int32(red) | np.int32(green) << LIGHT_BITS | np.int32(blue) << (2 * LIGHT_BITS)


DARK = (17.0, 6.0, 5.5)  # colour of skin that is seen from behind, in the mouth
OPAQUE, COVER_SHIFT = 255, 24  # cover of pages without any, and its bits in a texel
TEXELS_A_PIXEL = 1.0  # beyond which the next smaller texels are read


@dataclass(frozen=True, slots=True, eq=False, weakref_slot=True)
class LitSurface:
    """Constant arrays for drawing a face with baked light.

    Rows of the table of projected vertices: those of ``light.rows``, ``light.mouth_rows`` and ``light.ball_rows``, then
    vertices with constant light.

    Attributes
    ----------
    source : (V,)
        Vertex of the face of each row.
    behind : (V,)
        Rows of what lies in openings of a photographed skin, which hides them wherever it is.
    template : (V, 8)
        Texture coordinates, and the light that is constant.
    triangles : (D, 3)
        Rows of the table, counter-clockwise as they are drawn.
    piece_of, eye_of : (D,)
        Connected piece of each triangle, such as a lock of hair; its eye, -1 of none.
    of_eyes : (E,)
        Triangles of the eyes.
    eye_texture : (S, S, 3)
        Linear light.
    terms
        Of the vertices that are lit.
    """

    face: Face
    light: BakedLight
    rig: FaceRig
    terms: LightTerms
    source: NDArray[np.int32]
    behind: NDArray[np.bool_]
    template: NDArray[np.float32]
    triangles: NDArray[np.int32]
    piece_of: NDArray[np.int32]
    eye_of: NDArray[np.int32]
    of_eyes: NDArray[np.intp]
    eye_texture: NDArray[np.float32]


@shared
def build_surface(face: Face, own: Lit) -> LitSurface:
    """Surface of a face with light of its own.

    Raises
    ------
    DataError
        The face has more triangles than a picture can tell apart.
    """
    light, rig = own.baked.of_drawn(face.triangles), build_rig(face)
    if len(light.triangles) > MAX_TRIANGLES:
        raise DataError(f"a face with light may have {MAX_TRIANGLES} triangles, not {len(light.triangles)}")
    backs = light.triangles < 0
    numbers = light.triangle_numbers
    corners = face.triangles[numbers]
    corners[backs] = corners[backs][:, ::-1]
    part_of = np.repeat(np.arange(len(face.parts), dtype=np.int32), [part.count for part in face.parts])[numbers]
    pages = np.array([light.page_of.get(part.name, N_PAGES) for part in face.parts])
    n_vertices = len(face.vertices)
    dark = backs & (pages[part_of] == 0) & light.is_inside
    keys = corners + np.where(dark, n_vertices, 0)[:, None]  # a vertex of the dark is another row
    lit = np.concatenate([light.rows, light.mouth_rows, light.ball_rows])
    others = np.setdiff1d(keys, lit)
    order = np.concatenate([lit, others])
    row_of = np.zeros(2 * n_vertices, np.int32)
    row_of[order] = np.arange(len(order))
    page_of = np.full(2 * n_vertices, N_PAGES)
    page_of[keys] = np.where(dark, N_PAGES, pages[part_of])[:, None]
    source = (order % n_vertices).astype(np.int32)
    uv = np.zeros((n_vertices, 2)) if face.uv is None else face.uv
    template = np.zeros((len(order), N_COLUMNS), np.float32)
    template[:, U : V + 1] = page_places(uv[source].astype(np.float64), page_of[order], light.turn_side)
    template[order >= n_vertices, RED:] = DARK
    eye_of = np.full(len(corners), -1, np.int32)
    for number, eye in enumerate(face.eyes):
        eye_of[((corners >= eye.first) & (corners < eye.first + eye.count)).all(axis=1)] = number
    iris = next((part for part in face.parts if part.name == "iris"), None)
    picture = face.textures[iris.texture].pixels if iris is not None else np.full((2, 2, 3), 255, np.uint8)
    return LitSurface(
        face=face,
        light=light,
        rig=rig,
        terms=light_terms(face, rig, light),
        source=source,
        behind=(page_of[order] != 0) if own.is_flat else np.zeros(len(order), bool),
        template=template,
        triangles=np.ascontiguousarray(row_of[keys]),
        piece_of=connected_pieces(corners, n_vertices)[corners[:, 0]],  # edges of a part's pieces lie over each other
        eye_of=eye_of,
        of_eyes=np.flatnonzero(eye_of >= 0),
        eye_texture=(decode_srgb(picture / 255.0) * light.eye_gain).astype(np.float32),
    )


def page_places(uv: NDArray[np.float64], page: NDArray[np.int64], least_side: int) -> NDArray[np.float64]:
    """(N, 2) places in both pages, one above the other, of places (N, 2) in a page (N,); `N_PAGES` is the black below.

    Half a texel of pages of `least_side` is kept from their edges.
    """
    half = 0.5 / least_side
    inside = np.clip(uv[:, 1], half, 1 - half)
    down = np.where(page < N_PAGES, page + inside, N_PAGES + 0.5 / BLACK_SHARE)
    return np.column_stack([np.where(page < N_PAGES, uv[:, 0], 0.5), down / (N_PAGES + 1 / BLACK_SHARE)])


def stack_pages(
    pages: NDArray[np.uint8], level: int, covers: NDArray[np.uint8] | None = None
) -> tuple[NDArray[np.int32], tuple[int, int]]:
    """Texels (N,) of 8 bits a number, of pages (2, H, W, 3) halved `level` times; and (width, height).

    The fourth number is the cover (2, H, W), if there is one.
    """
    height, width = (side >> level for side in pages.shape[1:3])
    stacked = np.zeros((2 * height + height // BLACK_SHARE, width, 4), np.uint8)
    stacked[: 2 * height, :, :3] = _halved(pages, level).reshape(-1, width, 3)
    if covers is not None:
        stacked[: 2 * height, :, 3] = _halved(covers, level).reshape(-1, width)
        stacked[2 * height :, :, 3] = OPAQUE
    return stacked.view("<i4").astype(np.int32, copy=False).ravel(), (width, len(stacked))


def _halved(pages: NDArray[np.uint8], level: int) -> NDArray[np.uint8]:
    """Pages (2, H, W, ...) halved `level` times."""
    if level == 0:
        return pages
    shrunk = pages.astype(np.float32)
    for _ in range(level):
        shrunk = shrunk[:, ::2, ::2] + shrunk[:, 1::2, ::2] + shrunk[:, ::2, 1::2] + shrunk[:, 1::2, 1::2]
        shrunk *= np.float32(0.25)
    return np.rint(shrunk).astype(np.uint8)


def still_change(side: int) -> tuple[NDArray[np.int32], tuple[int, int]]:
    """Texels of no change of light, for pages of a side, and (width, height)."""
    height = N_PAGES * side + side // BLACK_SHARE
    zero = int(LIGHT_ZERO)
    return np.full(height * side, zero | zero << LIGHT_BITS | zero << 2 * LIGHT_BITS, np.int32), (side, height)
