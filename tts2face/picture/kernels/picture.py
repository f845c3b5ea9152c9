"""Drawing of one picture by the rasterisation and shading kernels, band by band."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.picture.camera import CameraMatrices
from tts2face.picture.cards import Strands
from tts2face.picture.kernels.cutouts import Textures, draw_cutouts
from tts2face.picture.kernels.fragments import (
    PIXEL_ENDS,
    Band,
    Facets,
    Fragments,
    Materials,
    evaluate_fragments,
    face_normals,
    find_fragments,
    vertex_normals,
)
from tts2face.picture.kernels.raster import (
    HOLES,
    N_LAYERS,
    N_PHASES,
    TRANSLUCENT,
    Batch,
    Geometry,
    draw_band,
    gather_triangles,
    sort_into_bands,
    transform_to_camera,
)
from tts2face.picture.kernels.resolve import compose_band
from tts2face.picture.kernels.shade import N_SCRATCH_ROWS, light_vertices, scatter_light, shade_fragments
from tts2face.picture.kernels.strand_light import (
    AT_NEAR,
    AT_U,
    AT_X,
    AT_Y,
    N_FRAGMENT_ROWS,
    N_STRAND_COLUMNS,
    Cards,
    StrandFragments,
    light_strands,
)
from tts2face.picture.kernels.strands import FRAGMENTS_AT_ONCE, Covered, StrandScene, draw_strands
from tts2face.picture.kernels.tables import COLOUR, N_ROWS, N_VERTEX_COLUMNS, UV
from tts2face.picture.kernels.tones import TONE_TABLES
from tts2face.picture.surface import Surface

BAND_SAMPLES = 65_536  # per band of rows; the time is the same from 16,384 to 262,144
ROW_PADDING = 80  # extra entries per table row, so that rows do not all start in one cache set


@dataclass(frozen=True, slots=True, eq=False)
class DrawingBuffers:
    """Buffers for drawing one picture at a time; `tts2face.picture.kernels.raster` and `fragments` describe the arrays.

    ``side`` is the number of samples along a pixel's side; ``vertex`` is initialised with colours and uv, ``strands``
    with uv. ``through`` and ``strand_colour`` are of size 0 for a face without strands.
    """

    side: int
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
    fragments: Fragments
    scratch: NDArray[np.float32]
    strands: NDArray[np.float32]
    through: NDArray[np.float32]
    strand_colour: NDArray[np.float32]
    strand_fragments: StrandFragments

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


def allocate_buffers(surface: Surface, size: tuple[int, int], side: int) -> DrawingBuffers:
    """Buffers for a surface and pictures of `size` (width, height) px, with side x side samples a pixel."""
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
        fragments=Fragments(
            number_of=np.zeros(max_fragments, np.int32),
            spread=np.zeros((max_fragments, 3), np.float32),
            table=np.zeros((N_ROWS, max_fragments), np.float32),
            colour=np.zeros((3, max_fragments), np.float32),
            pixels=np.zeros((pixels[0] * pixels[1], PIXEL_ENDS + N_LAYERS + 1), np.int32),
        ),
        scratch=np.zeros((N_SCRATCH_ROWS, max_fragments), np.float32),
        strands=strands,
        through=np.zeros((*covered, side * side), np.float32),
        strand_colour=np.zeros((*covered, 3), np.float32),
        strand_fragments=StrandFragments(
            which=np.zeros((3, FRAGMENTS_AT_ONCE), np.int32),
            rows=np.zeros((N_FRAGMENT_ROWS, FRAGMENTS_AT_ONCE), np.float32),
        ),
    )


def draw_surface(
    pose: Pose, surface: Surface, optics: CameraMatrices, buffers: DrawingBuffers, picture: NDArray[np.uint8]
) -> None:
    """Draw a surface over the background in `picture` (H, W, 3 or 4), sRGB, in place."""
    lens = optics.lens
    side = buffers.side
    fragments = buffers.fragments
    height, width = picture.shape[0] * side, picture.shape[1] * side
    members = project_surface(pose.points, surface, (optics.view, lens), buffers, (width, height))
    light_surface(pose, surface, lens, buffers)
    cards = arrange_cards(surface.strands, buffers.strands)
    facets = Facets(buffers.flat, surface.part_of)
    scene = Materials(
        triangles=surface.triangles,
        part_of=surface.part_of,
        materials=surface.materials,
        texels=surface.texels,
        levels=surface.levels,
        linear=TONE_TABLES[0],
        eyes=pose.eyes,
    )
    for first_row in range(0, height, buffers.band_rows):
        layers = draw_samples(surface, lens, members, first_row, buffers)
        blend_strands(surface, cards, first_row, pose.lights, buffers)
        n_rows = min(buffers.band_rows, height - first_row)
        band = Band(first_row, n_rows, side, buffers.owner, buffers.through, buffers.strand_colour)
        n_pixels = find_fragments(band, layers, facets, fragments)
        if n_pixels == 0:
            continue
        n_fragments = int(fragments.pixels[n_pixels - 1, PIXEL_ENDS + N_LAYERS])
        evaluate_fragments(fragments, n_fragments, buffers.vertex, scene, lens, side)
        shade_fragments(fragments.table, n_fragments, pose.lights, buffers.scratch, fragments.colour)
        compose_band(band, facets, fragments, n_pixels, picture, TONE_TABLES)


def light_surface(pose: Pose, surface: Surface, lens: NDArray[np.float64], buffers: DrawingBuffers) -> None:
    """Write normals and light of the projected vertices, and the strand table."""
    vertex = buffers.vertex
    skin = surface.skin
    strands = surface.strands
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
    """Write ``depth`` and ``owner`` of the band of the projected triangles `members` that begins at a row.

    Returns the number of valid layers.
    """
    phases = first_row // buffers.band_rows * N_PHASES
    bounds = buffers.band_starts[phases : phases + N_PHASES + 1]
    geometry = Geometry(buffers.vertex, surface.triangles, lens)
    batch = Batch(buffers.corners, buffers.boxes, buffers.source, members, bounds)
    layers = N_LAYERS if bounds[TRANSLUCENT] < bounds[TRANSLUCENT + 1] else 1
    draw_band(geometry, batch, first_row, buffers.depth, buffers.owner)
    if bounds[HOLES] < bounds[HOLES + 1]:
        textures = Textures(surface.texels, surface.levels, surface.texture_of)
        draw_cutouts(geometry, textures, batch, (first_row, buffers.side, layers), buffers.depth, buffers.owner)
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
        Cards(buffers.strands, cards.triangles, ends, cards.texture, cards.gloss, cards.mean_light),
        order,
        StrandScene(surface.texels, surface.levels, TONE_TABLES[0], lights),
        Covered(first_row, buffers.side, buffers.depth[0], buffers.through, buffers.strand_colour),
        buffers.strand_fragments,
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
    members = np.zeros(2 * len(surface.triangles), np.int32)
    triangles = (buffers.boxes, buffers.source, surface.phase)
    sort_into_bands(triangles, count, buffers.band_rows, buffers.band_starts, members)
    if buffers.band_starts[-1] > len(members):
        members = np.zeros(buffers.band_starts[-1], np.int32)
        sort_into_bands(triangles, count, buffers.band_rows, buffers.band_starts, members)
    return members
