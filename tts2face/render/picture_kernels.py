"""Drawing of one picture: the rasterisation and shading kernels, band by band."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.render.camera import CameraMatrices
from tts2face.render.cutouts import draw_cutouts
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

BAND_SAMPLES = 65_536  # per band of rows; the time is the same from 16,384 to 262,144
TONE_STEPS = 8192  # entries of the table from linear light to 8 bits; resolves the darkest step
ROW_PADDING = 80  # extra entries per table row, so that rows do not all start in one cache set
TONE_TABLES = (linear_table(), encoding_table(TONE_STEPS))


@dataclass(frozen=True, slots=True, eq=False)
class DrawingBuffers:
    """Buffers for drawing one picture at a time; `tts2face.render.raster` and `fragments` describe the arrays.

    ``side`` is the number of samples along a pixel's side; ``vertex`` is initialised with colours and uv.
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
    """Buffers for a surface, pictures of `size` (width, height) px, and side x side samples per pixel."""
    n_vertices, n_triangles = len(surface.rig.rest), len(surface.triangles)
    width, height = size[0] * side, size[1] * side
    rows = side * max(1, BAND_SAMPLES // (width * side))
    max_fragments = N_LAYERS * width * rows + ROW_PADDING
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
        found=(np.zeros(max_fragments, np.int32), np.zeros((max_fragments, 3), np.float32)),
        fragments=np.zeros((N_ROWS, max_fragments), np.float32),
        scratch=np.zeros((N_SCRATCH_ROWS, max_fragments), np.float32),
        colour=np.zeros((3, max_fragments), np.float32),
        pixels=np.zeros((width * rows // side**2, PIXEL_ENDS + N_LAYERS + 1), np.int32),
    )


def draw_surface(
    points: NDArray[np.float32],
    surface: Surface,
    optics: CameraMatrices,
    lights: tuple[NDArray[np.float32], NDArray[np.float32]],
    buffers: DrawingBuffers,
    picture: NDArray[np.uint8],
) -> None:
    """Draw a surface over the background in `picture`, in place.

    Parameters
    ----------
    points : (V, 3)
        World positions of the vertices, mm.
    lights
        Light table of `tts2face.render.shade.shade_fragments`, and the exposure (V, 4) of each vertex.
    picture : (H, W, 3 or 4)
        Background on entry, sRGB; the drawn picture on return.
    """
    buffers.vertex[:, EXPOSURE : EXPOSURE + 4] = lights[1]
    lens, side = optics.lens, buffers.side
    height, width = picture.shape[0] * side, picture.shape[1] * side
    batch = project_surface(points, surface, (optics.view, optics.lens), buffers, (width, height))
    face_normals(buffers.vertex, surface.triangles, buffers.flat)
    vertex_normals(buffers.flat, surface.starts, surface.members, buffers.vertex)
    scene = (surface.triangles, surface.part_of, surface.materials, surface.texture, TONE_TABLES[0])
    facets = (buffers.flat, surface.part_of)
    n_rows = buffers.depth.shape[1]
    for band, (begin, end) in enumerate(zip(buffers.band_starts[:-1], buffers.band_starts[1:], strict=True)):
        if begin == end:
            continue
        place = (band * n_rows, min(n_rows, height - band * n_rows), side)
        members = batch[begin:end]
        layers = draw_samples(surface, lens, members, place[0], buffers)
        n_pixels = find_fragments(buffers.owner, layers, place, facets, buffers.found, buffers.pixels)
        if n_pixels == 0:
            continue
        n_fragments = int(buffers.pixels[n_pixels - 1, PIXEL_ENDS + N_LAYERS])
        evaluate_fragments(buffers.found, n_fragments, buffers.vertex, scene, lens, buffers.fragments)
        shade_fragments(buffers.fragments, n_fragments, lights[0], buffers.scratch, buffers.colour)
        shading = (buffers.fragments, buffers.colour)
        compose_band(
            buffers.owner,
            place,
            (buffers.pixels, n_pixels),
            (buffers.found[0], *facets),
            shading,
            (picture, TONE_TABLES),
        )


def draw_samples(
    surface: Surface, lens: NDArray[np.float64], members: NDArray[np.int32], first_row: int, buffers: DrawingBuffers
) -> int:
    """Draw the projected triangles `members` of a band into ``depth`` and ``owner``; the number of valid layers."""
    holes = members[:0]
    if surface.cut_out.any():
        source = buffers.source[members]
        has_holes = surface.cut_out[np.where(source >= 0, source, ~source)]
        members, holes = members[~has_holes], members[has_holes]
    geometry = (buffers.vertex, surface.triangles, surface.translucent, lens)
    batch = (buffers.corners, buffers.source, members)
    layers = N_LAYERS if draw_band(geometry, batch, first_row, buffers.depth, buffers.owner) else 1
    if len(holes):
        draw_cutouts(
            (buffers.vertex, surface.triangles, lens),
            surface.alpha,
            (buffers.corners, buffers.source, holes),
            (first_row, buffers.side, layers),
            buffers.depth,
            buffers.owner,
        )
    return layers


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
    count = gather_triangles(
        buffers.vertex, buffers.grid, surface.triangles, (lens, size), buffers.corners, buffers.source
    )
    n_rows = buffers.depth.shape[1]
    members = np.zeros(2 * len(surface.triangles), np.int32)
    sort_into_bands(buffers.corners, count, n_rows, buffers.band_starts, members)
    if buffers.band_starts[-1] > len(members):
        members = np.zeros(buffers.band_starts[-1], np.int32)
        sort_into_bands(buffers.corners, count, n_rows, buffers.band_starts, members)
    return members
