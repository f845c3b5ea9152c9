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
    bent = np.zeros(max(width, 3), np.uint8)
    depth_step = np.float32(mm)
    for layer in range(n_layers):
        for r in range(n_rows + 2):
            for x in range(width):
                seen[r, x] = visible_part(owner[layer, r, x], part_of)
        for r in range(n_rows + 1):
            mark_steps(seen[r], seen[r + 1], r > 0, edges[max(r - 1, 0)], edges[min(r, n_rows - 1)])
            if r > 0:
                value, above, below = near[layer, r], near[layer, r - 1], near[layer, r + 1]
                own, upper, lower = edges[r - 1], edges[max(r - 2, 0)], edges[min(r, n_rows - 1)]
                for x in range(width):
                    bends = abs(above[x] - value[x] - value[x] + below[x]) > value[x] * value[x] * depth_step
                    own[x] |= bends
                    upper[x] |= bends
                    lower[x] |= bends
                for x in range(1, width - 1):
                    bent[x] = abs(value[x - 1] - value[x] - value[x] + value[x + 1]) > value[x] * value[x] * depth_step
                for x in range(1, width - 1):
                    own[x] |= bent[x - 1] | bent[x] | bent[x + 1]
                own[0] |= bent[1]
                own[width - 1] |= bent[width - 2]


@kernel
def mark_steps(own: Array, below: Array, is_inside: bool, upper: Array, lower: Array) -> None:
    """Mark in two rows of pixels `upper` and `lower` (W,) the neighbours that show different parts (W,).

    Only neighbours above each other where `own` is a row outside of the band.
    """
    for x in range(len(own)):
        differs = own[x] != below[x]
        upper[x] |= differs
        lower[x] |= differs
    if is_inside:
        for x in range(len(own) - 1):
            upper[x] |= (own[x] != below[x + 1]) | (own[x] != own[x + 1])
        for x in range(len(own) - 1):
            lower[x] |= below[x] != own[x + 1]
        for x in range(1, len(own)):
            upper[x] |= (below[x - 1] != own[x]) | (own[x - 1] != own[x])
        for x in range(1, len(own)):
            lower[x] |= own[x - 1] != below[x]


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
