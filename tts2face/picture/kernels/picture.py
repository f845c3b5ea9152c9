"""Drawing of one picture: the rasterisation and shading kernels, band by band.

Sorting of projected triangles into bands of rows.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.numeric.kernels import kernel
from tts2face.picture.camera import CameraMatrices
from tts2face.picture.kernels.edges import draw_cutouts, find_edges, mark_thin, mark_tiles
from tts2face.picture.kernels.fragments import (
    PIXEL_ENDS,
    evaluate_fragments,
    face_normals,
    find_fragments,
    vertex_normals,
)
from tts2face.picture.kernels.raster import (
    GRID_SHIFT,
    HOLES,
    LATER,
    N_LAYERS,
    N_PHASES,
    NOT_DRAWN,
    TILE_SAMPLES,
    TRANSLUCENT,
    draw_band,
    gather_triangles,
    transform_to_camera,
)
from tts2face.picture.kernels.resolve import compose_band
from tts2face.picture.kernels.shade import N_SCRATCH_ROWS, light_vertices, scatter_light, shade_fragments
from tts2face.picture.kernels.strands import (
    AT_NEAR,
    AT_U,
    AT_X,
    AT_Y,
    FRAGMENTS_AT_ONCE,
    N_FRAGMENT_ROWS,
    N_STRAND_COLUMNS,
    draw_strands,
    light_strands,
)
from tts2face.picture.kernels.tables import COLOUR, N_ROWS, N_VERTEX_COLUMNS, TONE_TABLES, UV
from tts2face.picture.surface import Strands, Surface

Array = NDArray[Any]


@kernel
def sort_into_bands(batch: Any, count: int, rows: tuple[int, int], starts: Array, members: Array) -> None:
    """Sort triangles stably by the bands of rows that they overlap, and by phase within a band (counting sort).

    Phase p of band b is ``members[starts[4 * b + p]:starts[4 * b + p + 1]]``. With `members` too short, only `starts`
    is written.

    Parameters
    ----------
    batch
        Boxes and source of `gather_triangles`, and the phase of the front and the back of each triangle (F, 2).
    rows
        Rows of a band, and the rows beyond it that it draws as well, on either side.
    """
    boxes, source, phase = batch
    n_bands = (len(starts) - 1) // N_PHASES
    band_rows, beyond = rows
    for bucket in range(len(starts)):
        starts[bucket] = 0
    for turn in range(2):
        for i in range(count):
            own = phase[source[i], 0] if source[i] >= 0 else phase[~source[i], 1]
            if own == NOT_DRAWN:
                continue
            low: Any = (np.int64(boxes[i, 2]) >> GRID_SHIFT) - beyond
            high: Any = (np.int64(boxes[i, 3]) >> GRID_SHIFT) + beyond
            for band in range(max(low // band_rows, 0), min(high // band_rows, n_bands - 1) + 1):
                bucket = band * N_PHASES + own
                if turn == 0:
                    starts[bucket + 1] += 1
                else:
                    members[starts[bucket]] = i
                    starts[bucket] += 1
        if turn == 0:
            for bucket in range(len(starts) - 1):
                starts[bucket + 1] += starts[bucket]
            if starts[-1] > len(members):
                return
    for bucket in range(len(starts) - 1, 0, -1):
        starts[bucket] = starts[bucket - 1]
    starts[0] = 0


BAND_SAMPLES = 65_536  # per band of rows; the time is the same from 16,384 to 262,144
ROW_PADDING = 80  # extra entries per table row, so that rows do not all start in one cache set
EDGE_STEP_MM = 0.8  # bend of a surface in depth, over two pixels, beyond which a pixel needs its samples
EVERY_TILE = np.zeros((0, 0), np.uint8)


@dataclass(frozen=True, slots=True, eq=False)
class DrawingBuffers:
    """Buffers for drawing one picture at a time; `tts2face.picture.kernels.raster` and `fragments` describe the arrays.

    ``side`` is the number of samples along a pixel's side; with ``samples_all`` every pixel has them, else those at
    edges; ``vertex`` is initialised with colours and uv, ``strands``
    with uv. ``near`` and ``centre`` are depth and owner at the centres of pixels, with a row of pixels above and below
    the band. ``through`` and ``strand_colour`` are of size 0 for a face without strands.
    """

    side: int
    samples_all: bool
    vertex: NDArray[np.float32]
    grid: NDArray[np.int32]
    flat: NDArray[np.float32]
    sums: NDArray[np.float32]
    corners: NDArray[np.int32]
    boxes: NDArray[np.int32]
    source: NDArray[np.int32]
    band_starts: NDArray[np.int64]
    depth: NDArray[np.float32]
    owner: NDArray[np.int32]
    near: NDArray[np.float32]
    centre: NDArray[np.int32]
    edges: NDArray[np.uint8]
    tiles: NDArray[np.uint8]
    found: tuple[NDArray[np.int32], NDArray[np.float32]]
    fragments: NDArray[np.float32]
    scratch: NDArray[np.float32]
    colour: NDArray[np.float32]
    pixels: NDArray[np.int32]
    strands: NDArray[np.float32]
    through: NDArray[np.float32]
    strand_colour: NDArray[np.float32]
    strand_fragments: tuple[NDArray[np.int32], NDArray[np.float32]]

    @property
    def band_rows(self) -> int:
        """Rows of samples of a band."""
        return int(self.depth.shape[1])


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """A face in one pose.

    Positions ``points`` (V, 3), mm, light table (7, 6), exposure (V, 5), eye table, and the rotation (3, 3) of the
    strands into camera space.
    """

    points: NDArray[np.float32]
    lights: NDArray[np.float32]
    exposure: NDArray[np.float32]
    eyes: NDArray[np.float32]
    turn: NDArray[np.float32]


def allocate_buffers(
    surface: Surface, size: tuple[int, int], side: int, *, samples_all: bool = False
) -> DrawingBuffers:
    """Buffers for a surface and pictures of `size` (width, height) px, with side x side samples at edges, or in all."""
    n_vertices, n_triangles = len(surface.rig.rest), len(surface.triangles)
    width, height = size[0] * side, size[1] * side
    rows = side * max(1, BAND_SAMPLES // (width * side))
    max_fragments = N_LAYERS * width * rows + ROW_PADDING
    vertex = np.zeros((n_vertices, N_VERTEX_COLUMNS), np.float32)
    vertex[:, COLOUR : COLOUR + 3] = surface.colours
    vertex[:, UV : UV + 2] = surface.uv
    strands = np.zeros((len(surface.strands.vertices), N_STRAND_COLUMNS), np.float32)
    strands[:, AT_U : AT_U + 2] = surface.strands.uv
    pixels = (rows // side, size[0])
    covered = pixels if len(strands) else (0, 0)
    return DrawingBuffers(
        side=side,
        samples_all=samples_all or side == 1,
        vertex=vertex,
        grid=np.zeros((n_vertices, 2), np.int32),
        flat=np.zeros((n_triangles, 3), np.float32),
        sums=np.zeros((n_triangles if len(surface.skin.vertices) else 0, 3), np.float32),
        corners=np.zeros((2 * n_triangles, 6), np.int32),
        boxes=np.zeros((2 * n_triangles, 5), np.int32),
        source=np.zeros(2 * n_triangles, np.int32),
        band_starts=np.zeros(-(-height // rows) * N_PHASES + 1, np.int64),
        depth=np.zeros((N_LAYERS, rows, width), np.float32),
        owner=np.zeros((N_LAYERS, rows, width), np.int32),
        near=np.zeros((N_LAYERS, pixels[0] + 2, pixels[1]), np.float32),
        centre=np.zeros((N_LAYERS, pixels[0] + 2, pixels[1]), np.int32),
        edges=np.zeros(pixels, np.uint8),
        tiles=np.zeros((-(-rows // TILE_SAMPLES), -(-width // TILE_SAMPLES)), np.uint8),
        found=(np.zeros(max_fragments, np.int32), np.zeros((max_fragments, 3), np.float32)),
        fragments=np.zeros((N_ROWS, max_fragments), np.float32),
        scratch=np.zeros((N_SCRATCH_ROWS, max_fragments), np.float32),
        colour=np.zeros((3, max_fragments), np.float32),
        pixels=np.zeros((pixels[0] * pixels[1], PIXEL_ENDS + N_LAYERS + 1), np.int32),
        strands=strands,
        through=np.zeros((*covered, side * side), np.float32),
        strand_colour=np.zeros((*covered, 3), np.float32),
        strand_fragments=(
            np.zeros((3, FRAGMENTS_AT_ONCE), np.int32),
            np.zeros((N_FRAGMENT_ROWS, FRAGMENTS_AT_ONCE), np.float32),
        ),
    )


def draw_surface(
    pose: Pose, surface: Surface, optics: CameraMatrices, buffers: DrawingBuffers, picture: NDArray[np.uint8]
) -> None:
    """Draw a surface over the background in `picture` (H, W, 3 or 4), sRGB, in place."""
    lens, side = optics.lens, buffers.side
    height, width = picture.shape[0] * side, picture.shape[1] * side
    batch = project_surface(pose.points, surface, (optics.view, lens), buffers, (width, height))
    light_surface(pose, surface, lens, buffers)
    cards = arrange_cards(surface.strands, buffers.strands)
    facets = (buffers.flat, surface.part_of)
    textures = (surface.texels, surface.levels)
    scene = (surface.triangles, surface.part_of, surface.materials, textures, TONE_TABLES[0], side, pose.eyes)
    for band in range(len(buffers.band_starts) // N_PHASES):
        place = (band * buffers.band_rows, min(buffers.band_rows, height - band * buffers.band_rows), side)
        layers = draw_samples(surface, lens, batch, place[0], buffers)
        blend_strands(surface, cards, place[0], pose.lights, buffers)
        samples = (buffers.owner, buffers.centre, buffers.edges)
        owners = (*samples, buffers.through)
        n_pixels = find_fragments(owners, layers, place, facets, buffers.found, buffers.pixels)
        if n_pixels == 0:
            continue
        n_fragments = int(buffers.pixels[n_pixels - 1, PIXEL_ENDS + N_LAYERS])
        evaluate_fragments(buffers.found, n_fragments, buffers.vertex, scene, lens, buffers.fragments)
        shade_fragments(buffers.fragments, n_fragments, pose.lights, buffers.scratch, buffers.colour)
        shading = (buffers.fragments, buffers.colour, buffers.through, buffers.strand_colour)
        which = (buffers.found[0], *facets)
        compose_band(samples, place, (buffers.pixels, n_pixels), which, shading, (picture, TONE_TABLES))


def light_surface(pose: Pose, surface: Surface, lens: NDArray[np.float64], buffers: DrawingBuffers) -> None:
    """Write normals and light of the projected vertices, and the strand table."""
    vertex, skin, strands = buffers.vertex, surface.skin, surface.strands
    face_normals(vertex, surface.triangles, buffers.flat)
    vertex_normals(buffers.flat, surface.starts, surface.members, vertex)
    light_vertices(pose.exposure, pose.lights, surface.wrap, vertex)
    if len(skin.vertices):
        around = (skin.vertices, surface.starts, surface.members, skin.triangles)
        scatter_light(surface.triangles, around, skin.share, vertex, buffers.sums)
    if len(strands.vertices):
        outward, tangents = strands.outward @ pose.turn.T, strands.tangents @ pose.turn.T
        light = (pose.exposure, pose.lights, lens)
        light_strands(strands.vertices, outward, tangents, light, vertex, buffers.strands)


def draw_samples(
    surface: Surface, lens: NDArray[np.float64], members: NDArray[np.int32], first_row: int, buffers: DrawingBuffers
) -> int:
    """Draw the band of the projected triangles `members` that begins at a row; the number of valid layers.

    Writes ``near`` and ``centre`` at the centres of pixels, ``edges`` where a pixel needs more samples, and ``depth``
    and ``owner`` there. With one sample for each pixel all pixels need it.
    """
    side = buffers.side
    phases = first_row // buffers.band_rows * N_PHASES
    bounds = buffers.band_starts[phases : phases + N_PHASES + 1]
    geometry = (buffers.vertex, surface.triangles, lens)
    batch = (buffers.corners, buffers.boxes, buffers.source, members, bounds)
    has_holes = bounds[HOLES] < bounds[HOLES + 1]
    layers = N_LAYERS if bounds[TRANSLUCENT] < bounds[TRANSLUCENT + 1] else 1
    wanted = EVERY_TILE
    buffers.edges[:] = 1
    if not buffers.samples_all and not has_holes:
        draw_band(geometry, batch, (first_row // side - 1, side), EVERY_TILE, buffers.near, buffers.centre)
        buffers.edges[:] = 0
        find_edges((buffers.near, buffers.centre), layers, surface.part_of, EDGE_STEP_MM, buffers.edges)
        later = members[bounds[LATER] : bounds[LATER + 1]]
        mark_thin(buffers.boxes, buffers.source, later, surface.thin, (first_row, side), buffers.edges)
        mark_tiles(buffers.edges, side, buffers.tiles)
        wanted = buffers.tiles
    draw_band(geometry, batch, (first_row, 1), wanted, buffers.depth, buffers.owner)
    if has_holes:
        textures = (surface.texels, surface.levels, surface.texture_of)
        draw_cutouts(
            geometry,
            textures,
            (buffers.corners, buffers.source, members[bounds[HOLES] : bounds[HOLES + 1]]),
            (first_row, side, layers),
            buffers.depth,
            buffers.owner,
        )
    return layers


def arrange_cards(cards: Strands, table: NDArray[np.float32]) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """Order (F,) of the triangles of cards from front to back, and which of their edges (F, 3) end what is seen.

    These are the borders of cards, and edges where a card turns away.
    """
    order = np.argsort(-table[:, AT_NEAR][cards.triangles].mean(axis=1), kind="stable")
    x, y = table[:, AT_X][cards.triangles], table[:, AT_Y][cards.triangles]
    faces = (x[:, 1] - x[:, 0]) * (y[:, 2] - y[:, 0]) > (x[:, 2] - x[:, 0]) * (y[:, 1] - y[:, 0])
    ends = (cards.neighbours < 0) | (faces[cards.neighbours] != faces[:, None]) if len(order) else cards.neighbours < 0
    return order, ends


def blend_strands(
    surface: Surface, arranged: tuple[Any, Any], first_row: int, lights: NDArray[np.float32], buffers: DrawingBuffers
) -> None:
    """Write the passing light and the colour of strands of a band; `arranged` as `arrange_cards` returns it."""
    order, ends = arranged
    if not len(order):
        return
    cards = surface.strands
    buffers.through[:], buffers.strand_colour[:] = 1, 0
    draw_strands(
        (buffers.strands, cards.triangles, ends, cards.texture, cards.gloss, cards.mean_light),
        order,
        (surface.texels, surface.levels, TONE_TABLES[0], lights),
        (first_row, buffers.side, buffers.depth[0], buffers.near[0], buffers.edges),
        buffers.strand_fragments,
        (buffers.through, buffers.strand_colour),
    )


def project_surface(
    points: NDArray[np.float32],
    surface: Surface,
    optics: tuple[Any, Any],
    buffers: DrawingBuffers,
    size: tuple[int, int],
) -> NDArray[np.int32]:
    """Project a surface for a camera (view, lens); returns the triangle indices of all bands, concatenated.

    Writes ``vertex``, ``grid``, ``corners``, ``source`` and ``band_starts`` of `buffers`.
    """
    view, lens = optics
    transform_to_camera(points, view, lens, buffers.vertex, buffers.grid)
    found = (buffers.corners, buffers.boxes, buffers.source)
    count = gather_triangles(buffers.vertex, buffers.grid, surface.triangles, (lens, size), found)
    rows = (buffers.band_rows, buffers.side)
    members = np.zeros(2 * len(surface.triangles), np.int32)
    triangles = (buffers.boxes, buffers.source, surface.phase)
    sort_into_bands(triangles, count, rows, buffers.band_starts, members)
    if buffers.band_starts[-1] > len(members):
        members = np.zeros(buffers.band_starts[-1], np.int32)
        sort_into_bands(triangles, count, rows, buffers.band_starts, members)
    return members
