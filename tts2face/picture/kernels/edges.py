"""Pixels that need more than one sample: those at edges of what is seen, and those under thin parts.

Triangles with holes: samples are drawn where the alpha of the texture reaches a threshold of their own.

The thresholds of the samples of a pixel are spread evenly from 0 to 1, so that the mean over the samples has soft edges
in any order of drawing (alpha to coverage); without supersampling the threshold is one half.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.numeric.kernels import inlined_kernel, kernel
from tts2face.picture.kernels.raster import (
    BACK_BIAS,
    GRID_SHIFT,
    HALF_GRID,
    NO_TRIANGLE,
    TILE_SAMPLES,
    depth_plane,
    edge_function,
)
from tts2face.picture.kernels.tables import UV

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
        As for `tts2face.picture.kernels.raster.draw_band`, of the band and phase.
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


@kernel
def texel_alpha(texels: Array, place: Array, u: float, v: float) -> float:
    """Bilinear coverage, 0 to 255, at (u, v) of a level of `tts2face.picture.textures`."""
    begin, width, height = place[0], place[1], place[2]
    x = min(max(u * width - 0.5, 0.0), width - 1.0)
    y = min(max(v * height - 0.5, 0.0), height - 1.0)
    left, top = int(x), int(y)
    right, below = min(left + 1, width - 1), min(top + 1, height - 1)
    across, along = x - left, y - top
    top, below = begin + top * width, begin + below * width
    upper = texels[top + left, 3] * (1.0 - across) + texels[top + right, 3] * across
    lower = texels[below + left, 3] * (1.0 - across) + texels[below + right, 3] * across
    return float(upper * (1.0 - along) + lower * along)


@kernel
def sample_alpha(texture: tuple[Any, Any], vertex: Array, corners: tuple[int, int, int], dx: float, dy: float) -> float:
    """Coverage, 0 to 255, where the ray (dx, dy, 1) meets a triangle (Moeller and Trumbore 1997)."""
    a, b, c = corners
    sx, sy, sz = -np.float64(vertex[a, 0]), -np.float64(vertex[a, 1]), -np.float64(vertex[a, 2])
    e1x, e1y, e1z = vertex[b, 0] + sx, vertex[b, 1] + sy, vertex[b, 2] + sz
    e2x, e2y, e2z = vertex[c, 0] + sx, vertex[c, 1] + sy, vertex[c, 2] + sz
    qx, qy, qz = dy * e2z - e2y, e2x - dx * e2z, dx * e2y - dy * e2x
    determinant = e1x * qx + e1y * qy + e1z * qz
    inverse = 1.0 / determinant if determinant != 0.0 else 0.0
    rx, ry, rz = sy * e1z - sz * e1y, sz * e1x - sx * e1z, sx * e1y - sy * e1x
    wb = min(max((sx * qx + sy * qy + sz * qz) * inverse, 0.0), 1.0)
    wc = min(max((dx * rx + dy * ry + rz) * inverse, 0.0), 1.0 - wb)
    wa = 1.0 - wb - wc
    u = wa * vertex[a, UV] + wb * vertex[b, UV] + wc * vertex[c, UV]
    v = wa * vertex[a, UV + 1] + wb * vertex[b, UV + 1] + wc * vertex[c, UV + 1]
    return float(texel_alpha(texture[0], texture[1], u, v))


@kernel
def draw_cutouts(
    geometry: Any, textures: Any, batch: Any, place: tuple[int, int, int], depth: Array, owner: Array
) -> None:
    """Draw triangles with holes onto the opaque surface of a band, after `tts2face.picture.kernels.raster.draw_band`.

    Parameters
    ----------
    geometry
        Vertex table, triangles (F, 3), lens.
    textures
        Texels and levels of `tts2face.picture.textures`, and the texture of each triangle (F,).
    batch
        Corners, source, and the rows of both that touch the band and have holes.
    place
        The band's first row of samples, samples along a pixel's side, number of valid layers.
    depth, owner : (3, R, W)
        As `draw_band` writes them, changed in place; translucent layers behind a drawn sample are removed.
    """
    vertex, triangles, lens = geometry
    texels, levels, texture_of = textures
    corners, source, members = batch
    first_row, side, n_layers = place
    n_rows, width = depth.shape[1], depth.shape[2]
    n_samples = side * side
    for i in members:
        number = source[i]
        t = number if number >= 0 else ~number
        x0, y0, x1 = np.int64(corners[i, 0]), np.int64(corners[i, 1]), np.int64(corners[i, 2])
        y1, x2, y2 = np.int64(corners[i, 3]), np.int64(corners[i, 4]), np.int64(corners[i, 5])
        left = max((min(x0, x1, x2) + HALF_GRID - 1) >> GRID_SHIFT, 0)
        right = min((max(x0, x1, x2) - HALF_GRID) >> GRID_SHIFT, width - 1)
        top = max((min(y0, y1, y2) + HALF_GRID - 1) >> GRID_SHIFT, first_row)
        bottom = min((max(y0, y1, y2) - HALF_GRID) >> GRID_SHIFT, first_row + n_rows - 1)
        across, along, origin, least, most = depth_plane(vertex, triangles, t, lens)
        bias = np.float32(1) if number >= 0 else BACK_BIAS
        which = (triangles[t, 0], triangles[t, 1], triangles[t, 2])
        for row in range(top, bottom + 1):
            r, py = row - first_row, (row << GRID_SHIFT) + HALF_GRID
            dy = (row + 0.5 - lens[2]) / lens[0]
            for x in range(left, right + 1):
                px = (x << GRID_SHIFT) + HALF_GRID
                e0, e1 = edge_function(x1, y1, x2, y2, px, py), edge_function(x2, y2, x0, y0, px, py)
                if (e0 | e1 | edge_function(x0, y0, x1, y1, px, py)) < 0:
                    continue
                value = origin + along * (row + 0.5) + across * (x + 0.5)
                near = np.float32(min(max(value, least), most)) * bias
                if near <= depth[0, r, x]:
                    continue
                rank = ((row % side) * side + x % side + t) % n_samples
                if sample_alpha(
                    (texels, levels[texture_of[t], 0]), vertex, which, (x + 0.5 - lens[1]) / lens[0], dy
                ) * n_samples < 255.0 * (rank + 0.5):
                    continue
                depth[0, r, x], owner[0, r, x] = near, number
                for layer in range(1, n_layers):
                    if depth[layer, r, x] <= near:
                        depth[layer, r, x], owner[layer, r, x] = np.float32(0), NO_TRIANGLE
