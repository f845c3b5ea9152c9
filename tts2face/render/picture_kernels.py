"""One picture: the kernels of this room in their order, band by band."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.render.camera import CameraMatrices
from tts2face.render.fragments import (
    COLOUR,
    EXPOSURE,
    N_ROWS,
    N_VERTEX_COLUMNS,
    PIXEL_ENDS,
    UV,
    evaluate_fragments,
    face_normals,
    find_fragments,
    vertex_normals,
)
from tts2face.render.raster import N_LAYERS, draw_band, gather_triangles, sort_into_bands, transform_to_camera
from tts2face.render.resolve import compose_band
from tts2face.render.shade import N_SCRATCH_ROWS, shade_fragments
from tts2face.render.surface import Surface, encoding_table, linear_table

BAND_SAMPLES = 65_536  # of a band of rows that is drawn, then lit; from 16,384 to 262,144 the time is the same
TONE_STEPS = 8192  # entries of the table from linear light to 8 bits; fine enough for its darkest step
ROW_PADDING = 80  # entries beyond the last of a table's row, so that its rows do not all begin in one set of the cache
TONE_TABLES = (linear_table(), encoding_table(TONE_STEPS))


@dataclass(frozen=True, slots=True, eq=False)
class DrawingBuffers:
    """What one picture at a time needs while it is drawn; `tts2face.render.raster` and its neighbours name the parts.

    ``vertex`` holds colour and uv from the start.
    """

    side: int
    vertex: NDArray[np.float32]
    grid: NDArray[np.int32]
    flat: NDArray[np.float32]
    corners: NDArray[np.int32]
    source: NDArray[np.int32]
    band_starts: NDArray[np.int64]
    depth: NDArray[np.float32]
    owner: NDArray[np.int32]
    found: tuple[NDArray[np.int32], NDArray[np.float32]]
    fragments: NDArray[np.float32]
    scratch: NDArray[np.float32]
    colour: NDArray[np.float32]
    pixels: NDArray[np.int32]


def allocate_buffers(surface: Surface, size: tuple[int, int], side: int) -> DrawingBuffers:
    """Room to draw a surface into pictures of `size` (width, height) px with side x side samples in a pixel."""
    n_vertices, n_triangles = len(surface.rig.rest), len(surface.triangles)
    width, height = size[0] * side, size[1] * side
    rows = side * max(1, BAND_SAMPLES // (width * side))
    n_most = N_LAYERS * width * rows + ROW_PADDING
    vertex = np.zeros((n_vertices, N_VERTEX_COLUMNS), np.float32)
    vertex[:, COLOUR : COLOUR + 3] = surface.colours
    vertex[:, UV : UV + 2] = surface.uv
    return DrawingBuffers(
        side=side,
        vertex=vertex,
        grid=np.zeros((n_vertices, 2), np.int32),
        flat=np.zeros((n_triangles, 3), np.float32),
        corners=np.zeros((2 * n_triangles, 6), np.int32),
        source=np.zeros(2 * n_triangles, np.int32),
        band_starts=np.zeros(-(-height // rows) + 1, np.int64),
        depth=np.zeros((N_LAYERS, rows, width), np.float32),
        owner=np.zeros((N_LAYERS, rows, width), np.int32),
        found=(np.zeros(n_most, np.int32), np.zeros((n_most, 3), np.float32)),
        fragments=np.zeros((N_ROWS, n_most), np.float32),
        scratch=np.zeros((N_SCRATCH_ROWS, n_most), np.float32),
        colour=np.zeros((3, n_most), np.float32),
        pixels=np.zeros((width * rows // side**2, PIXEL_ENDS + N_LAYERS + 1), np.int32),
    )


def draw_surface(
    points: NDArray[np.float32],
    surface: Surface,
    optics: CameraMatrices,
    lights: tuple[NDArray[np.float32], NDArray[np.float32]],
    room: DrawingBuffers,
    picture: NDArray[np.uint8],
) -> None:
    """Draw the surface, its vertices (V, 3) in the world, over the background that the picture holds.

    `lights` are the table of `tts2face.render.shade.shade_fragments` and how much of each reaches every vertex (V, 4).
    """
    room.vertex[:, EXPOSURE : EXPOSURE + 4] = lights[1]
    lens, side = optics.lens, room.side
    height, width = picture.shape[0] * side, picture.shape[1] * side
    batch = project_surface(points, surface, (optics.view, optics.lens), room, (width, height))
    face_normals(room.vertex, surface.triangles, room.flat)
    vertex_normals(room.flat, surface.starts, surface.members, room.vertex)
    geometry = (room.vertex, surface.triangles, surface.translucent, lens)
    scene = (surface.triangles, surface.part_of, surface.materials, surface.texture, TONE_TABLES[0])
    facets = (room.flat, surface.part_of)
    n_rows = room.depth.shape[1]
    for band, (begin, end) in enumerate(zip(room.band_starts[:-1], room.band_starts[1:], strict=True)):
        if begin == end:
            continue
        place = (band * n_rows, min(n_rows, height - band * n_rows), side)
        members = batch[begin:end]
        n_translucent = draw_band(geometry, (room.corners, room.source, members), place[0], room.depth, room.owner)
        layers = N_LAYERS if n_translucent else 1
        n_pixels = find_fragments(room.owner, layers, place, facets, room.found, room.pixels)
        if n_pixels == 0:
            continue
        n_fragments = int(room.pixels[n_pixels - 1, PIXEL_ENDS + N_LAYERS])
        evaluate_fragments(room.found, n_fragments, room.vertex, scene, lens, room.fragments)
        shade_fragments(room.fragments, n_fragments, lights[0], room.scratch, room.colour)
        shown = (room.fragments, room.colour)
        compose_band(
            room.owner, place, (room.pixels, n_pixels), (room.found[0], *facets), shown, (picture, TONE_TABLES)
        )


def project_surface(
    points: NDArray[np.float32], surface: Surface, optics: tuple[Any, Any], room: DrawingBuffers, size: tuple[int, int]
) -> NDArray[np.int32]:
    """Bring the surface before a camera (view, lens); returns the triangles of all bands, one band behind the other."""
    view, lens = optics
    transform_to_camera(points, view, lens, room.vertex, room.grid)
    count = gather_triangles(room.vertex, room.grid, surface.triangles, (lens, size), room.corners, room.source)
    n_rows = room.depth.shape[1]
    members = np.zeros(2 * len(surface.triangles), np.int32)
    sort_into_bands(room.corners, count, n_rows, room.band_starts, members)
    if room.band_starts[-1] > len(members):
        members = np.zeros(room.band_starts[-1], np.int32)
        sort_into_bands(room.corners, count, n_rows, room.band_starts, members)
    return members
