"""Triangles with holes: samples are drawn where the alpha of the texture reaches a threshold of their own.

The thresholds of the samples of a pixel are spread evenly from 0 to 1, so that the mean over the samples has soft edges
in any order of drawing (alpha to coverage); without supersampling the threshold is one half.
"""

from typing import Any, NamedTuple

import numpy as np

from tts2face.numeric.arrays import Array
from tts2face.numeric.kernels import kernel
from tts2face.picture.kernels.raster import (
    BACK_BIAS,
    GRID_SHIFT,
    HALF_GRID,
    HOLES,
    NO_TRIANGLE,
    Batch,
    Geometry,
    depth_plane,
    edge_function,
)
from tts2face.picture.kernels.tables import UV


class Textures(NamedTuple):
    """Texels and levels of `tts2face.picture.textures`, and the texture of each triangle (F,)."""

    texels: Array
    levels: Array
    texture_of: Array


@kernel
def texel_alpha(texels: Array, place: Array, u: float, v: float) -> float:
    """Bilinear coverage, 0 to 255, at (u, v) of a level of `tts2face.picture.textures`."""
    start, width, height = place[0], place[1], place[2]
    x = min(max(u * width - 0.5, 0.0), width - 1.0)
    y = min(max(v * height - 0.5, 0.0), height - 1.0)
    left, top = int(x), int(y)
    right, below = min(left + 1, width - 1), min(top + 1, height - 1)
    across, along = x - left, y - top
    top, below = start + top * width, start + below * width
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
    geometry: Geometry, textures: Textures, batch: Batch, place: tuple[int, int, int], depth: Array, owner: Array
) -> None:
    """Draw triangles with holes onto the opaque surface of a band, after `tts2face.picture.kernels.raster.draw_band`.

    Parameters
    ----------
    geometry
        With a vertex table that has texture coordinates.
    place
        The band's first row of samples, samples along a pixel's side, number of valid layers.
    depth, owner : (3, R, W)
        As `draw_band` writes them, changed in place; translucent layers behind a drawn sample are removed.
    """
    vertex = geometry.vertex
    triangles = geometry.triangles
    lens = geometry.lens
    corners = batch.corners
    first_row, side, n_layers = place
    n_rows, width = depth.shape[1], depth.shape[2]
    n_samples = side * side
    for m in range(batch.bounds[HOLES], batch.bounds[HOLES + 1]):
        i = batch.members[m]
        number = batch.source[i]
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
        texture = (textures.texels, textures.levels[textures.texture_of[t], 0])
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
                alpha = sample_alpha(texture, vertex, which, (x + 0.5 - lens[1]) / lens[0], dy)
                if alpha * n_samples < 255.0 * (rank + 0.5):
                    continue
                depth[0, r, x], owner[0, r, x] = near, number
                for layer in range(1, n_layers):
                    if depth[layer, r, x] <= near:
                        depth[layer, r, x], owner[layer, r, x] = np.float32(0), NO_TRIANGLE
