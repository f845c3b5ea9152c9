"""Pixels that need more than one sample: those at edges of what is seen, and those under thin parts."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.compilation import inlined_kernel, kernel
from tts2face.render.raster import GRID_SHIFT, NO_TRIANGLE, TILE_SAMPLES

Array = NDArray[Any]


@kernel
def find_edges(centres: tuple[Any, Any], n_layers: int, part_of: Array, mm: float, edges: Array) -> None:
    """Mark the pixels that need more than one sample.

    These are pixels beside one of another part, of the other side of a part, or beyond a step in depth.

    Parameters
    ----------
    centres
        1/z and visible triangle at the centre of each pixel (3, R + 2, W), with one row of pixels above and below the
        band.
    part_of : (F,)
        Part of each triangle.
    mm
        Depth beyond which a step that does not continue the slope of the surface is an edge.
    edges : (R, W)
        Set to 1; pixels that are marked already stay so.
    """
    near, owner = centres
    n_rows, width = edges.shape
    seen = np.zeros((n_rows + 2, width), np.int32)
    for layer in range(n_layers):
        for r in range(n_rows + 2):
            for x in range(width):
                seen[r, x] = visible_part(owner[layer, r, x], part_of)
        for r in range(n_rows + 1):
            for x in range(width):
                own, below = seen[r, x], seen[r + 1, x]
                if own != below:
                    edges[max(r - 1, 0), x] = edges[min(r, n_rows - 1), x] = 1
                if r == 0:
                    continue
                value = near[layer, r, x]
                limit = value * value * np.float32(mm)
                if x + 1 < width:
                    beside, corner = seen[r, x + 1], seen[r + 1, x + 1]
                    if own != corner:
                        edges[r - 1, x] = edges[min(r, n_rows - 1), x + 1] = 1
                    if below != beside:
                        edges[min(r, n_rows - 1), x] = edges[r - 1, x + 1] = 1
                    if own != beside:
                        edges[r - 1, x] = edges[r - 1, x + 1] = 1
                    if x > 0:
                        bend = near[layer, r, x - 1] - value - value + near[layer, r, x + 1]
                        if abs(bend) > limit:
                            edges[r - 1, x - 1] = edges[r - 1, x] = edges[r - 1, x + 1] = 1
                bend = near[layer, r - 1, x] - value - value + near[layer, r + 1, x]
                if abs(bend) > limit:
                    edges[r - 1, x] = edges[max(r - 2, 0), x] = edges[min(r, n_rows - 1), x] = 1


@inlined_kernel
def visible_part(number: int, part_of: Array) -> Any:
    """Part p whose front a sample shows, ~p for its back; `NO_TRIANGLE` without a triangle."""
    part = number
    if number != NO_TRIANGLE:
        part = part_of[number] if number >= 0 else ~part_of[~number]
    return part


@kernel
def mark_thin(boxes: Array, source: Array, members: Array, thin: Array, place: tuple[int, int], edges: Array) -> None:
    """Mark the pixels under triangles of thin parts, which would fall between the centres of pixels.

    Parameters
    ----------
    boxes, source, members
        As for `tts2face.render.raster.draw_band`, of the band and phase.
    thin : (F,)
        Whether a triangle belongs to a thin part.
    place
        The band's first row of samples, samples along a pixel's side.
    """
    first_row, side = place
    step = side << GRID_SHIFT
    for i in members:
        t = source[i] if source[i] >= 0 else ~source[i]
        if thin[t]:
            low, high = boxes[i, 2] // step - first_row // side, boxes[i, 3] // step - first_row // side
            for r in range(max(low, 0), min(high, edges.shape[0] - 1) + 1):
                for x in range(max(boxes[i, 0] // step, 0), min(boxes[i, 1] // step, edges.shape[1] - 1) + 1):
                    edges[r, x] = 1


@kernel
def mark_tiles(edges: Array, side: int, wanted: Array) -> None:
    """Mark the tiles of samples that hold a pixel which needs them."""
    for r in range(wanted.shape[0]):
        for x in range(wanted.shape[1]):
            wanted[r, x] = 0
    for r in range(edges.shape[0]):
        for x in range(edges.shape[1]):
            if edges[r, x]:
                for row in (r * side, r * side + side - 1):
                    for column in (x * side, x * side + side - 1):
                        wanted[row // TILE_SAMPLES, column // TILE_SAMPLES] = 1
