"""Rasterisation: the visible triangle of each sample by exact edge functions on a fixed grid and a 1/z buffer.

Corners are snapped to 1/256 of a sample and the edge functions are integers, so that a sample on an edge shared by two
triangles belongs to exactly one of them (top-left rule). Depth is computed from the plane of the unsnapped triangle,
which also holds for triangles that the near plane clips. Every kernel releases the interpreter's lock and runs on one
thread; each picture is drawn by one thread, so its bytes do not depend on the number of threads. Camera space: x right,
y down, z ahead, mm. Sources: Pineda 1988 (edge functions), Olano and Greer 1997 (planes of the uncut triangle).
"""

from typing import Any, NamedTuple

import numpy as np

from tts2face.numeric.arrays import Array
from tts2face.numeric.kernels import inlined_kernel, kernel

GRID_SHIFT = 8
GRID = 1 << GRID_SHIFT  # steps of the snapping grid in one sample
HALF_GRID = GRID >> 1
NO_TRIANGLE = np.int32(2**31 - 1)  # no triangle at this sample
BACK_BIAS = np.float32(1.0 - 3e-4)  # back faces are moved 0.3 permille away, so that front faces win at equal depth
TILE_SAMPLES = 4  # samples along a side of the tiles that cull hidden back faces
N_LAYERS = 3  # the opaque surface and the two nearest translucent ones before it
# Phases of drawing: the largest opaque part, what it may hide, translucent parts, parts with holes; strands in none.
FIRST, LATER, TRANSLUCENT, HOLES, NOT_DRAWN = range(5)
N_PHASES = 4


class Geometry(NamedTuple):
    """Camera coordinates (V, 3 or more) of vertices, triangles (F, 3) and the lens (4,)."""

    vertex: Array
    triangles: Array
    lens: Array


class Batch(NamedTuple):
    """Corners, boxes and source of `gather_triangles`, their rows by bands and phases, bounds of a band's phases."""

    corners: Array
    boxes: Array
    source: Array
    members: Array
    bounds: Array


@kernel
def transform_to_camera(points: Array, view: Array, lens: Array, camera: Array, grid: Array) -> None:
    """Write camera coordinates of (V, 3) world points, and snapped picture coordinates of those beyond the near plane.

    `view` (3, 4) transforms world to camera space; `lens` is (focal length in samples, centre x, centre y, near plane).
    The first three columns of `camera` and both of `grid` are written.
    """
    focal, middle_x, middle_y, near = lens[0], lens[1], lens[2], lens[3]
    for v in range(len(points)):
        x, y, z = np.float64(points[v, 0]), np.float64(points[v, 1]), np.float64(points[v, 2])
        right = view[0, 0] * x + view[0, 1] * y + view[0, 2] * z + view[0, 3]
        down = view[1, 0] * x + view[1, 1] * y + view[1, 2] * z + view[1, 3]
        ahead = view[2, 0] * x + view[2, 1] * y + view[2, 2] * z + view[2, 3]
        camera[v, 0], camera[v, 1], camera[v, 2] = right, down, ahead
        if camera[v, 2] >= near:
            grid[v, 0] = np.int32(np.rint((middle_x + focal * right / ahead) * GRID))
            grid[v, 1] = np.int32(np.rint((middle_y + focal * down / ahead) * GRID))


@kernel
def clip_to_near_plane(camera: Array, grid: Array, triangle: Array, lens: Array, polygon: Array) -> int:
    """Write the snapped corners of the part of a triangle beyond the near plane; returns their number (0, 3 or 4)."""
    near = lens[3]
    n_corners = 0
    for c in range(3):
        a, b = triangle[c], triangle[(c + 1) % 3]
        a_visible, b_visible = camera[a, 2] >= near, camera[b, 2] >= near
        if a_visible:
            polygon[n_corners, 0], polygon[n_corners, 1] = grid[a, 0], grid[a, 1]
            n_corners += 1
        if a_visible == b_visible:
            continue
        inside, outside = (a, b) if a_visible else (b, a)  # the same for both triangles of the edge
        depth_in, depth_out = np.float64(camera[inside, 2]), np.float64(camera[outside, 2])
        share = (depth_in - near) / (depth_in - depth_out)
        right = camera[inside, 0] + share * (camera[outside, 0] - camera[inside, 0])
        down = camera[inside, 1] + share * (camera[outside, 1] - camera[inside, 1])
        polygon[n_corners, 0] = np.int64(np.rint((lens[1] + lens[0] * right / near) * GRID))
        polygon[n_corners, 1] = np.int64(np.rint((lens[2] + lens[0] * down / near) * GRID))
        n_corners += 1
    return n_corners


@inlined_kernel
def may_be_seen(low: int, high: int, n_samples: int) -> bool:
    """Whether the centre of a sample lies within a range of grid coordinates and within the picture."""
    return bool(max((low + HALF_GRID - 1) >> GRID_SHIFT, 0) <= min((high - HALF_GRID) >> GRID_SHIFT, n_samples - 1))


@kernel
def gather_triangles(
    camera: Array, grid: Array, triangles: Array, optics: tuple[Any, Any], found: tuple[Any, Any, Any]
) -> int:
    """Write the snapped corners of potentially visible triangles in one winding; returns their number.

    Parameters
    ----------
    optics
        Lens, and (width, height) of the picture in samples.
    found
        Out, for each triangle: x, y of three corners on the grid, of positive area (2 F, 6); least and greatest x and
        y, and the bits of the greatest 1/z (2 F, 5); its index t, or ~t where its back faces the camera (2 F,).
    """
    lens, size = optics
    corners, boxes, source = found
    nearest = np.zeros(1, np.float32)
    bits = nearest.view(np.int32)
    count = 0
    polygon = np.zeros((4, 2), np.int64)
    for t in range(len(triangles)):
        n_corners = 3
        ahead = min(camera[triangles[t, 0], 2], camera[triangles[t, 1], 2], camera[triangles[t, 2], 2])
        nearest[0] = np.float32(1) / max(ahead, np.float32(lens[3]))
        if ahead >= lens[3]:
            for c in range(3):
                polygon[c, 0], polygon[c, 1] = grid[triangles[t, c], 0], grid[triangles[t, c], 1]
        else:
            n_corners = clip_to_near_plane(camera, grid, triangles[t], lens, polygon)
        for c in range(1, n_corners - 1):
            x0, y0, x1, y1 = polygon[0, 0], polygon[0, 1], polygon[c, 0], polygon[c, 1]
            x2, y2 = polygon[c + 1, 0], polygon[c + 1, 1]
            least_x, most_x = min(x0, x1, x2), max(x0, x1, x2)
            least_y, most_y = min(y0, y1, y2), max(y0, y1, y2)
            if not may_be_seen(least_x, most_x, size[0]) or not may_be_seen(least_y, most_y, size[1]):
                continue
            area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
            if area == 0:
                continue
            if area < 0:  # y runs down: counter-clockwise seen from outside has negative area
                x1, y1, x2, y2 = x2, y2, x1, y1
            corners[count, 0], corners[count, 1], corners[count, 2] = x0, y0, x1
            corners[count, 3], corners[count, 4], corners[count, 5] = y1, x2, y2
            boxes[count, 0], boxes[count, 1], boxes[count, 2], boxes[count, 3] = least_x, most_x, least_y, most_y
            boxes[count, 4] = bits[0]
            source[count] = t if area < 0 else ~t
            count += 1
    return count


@kernel
def sort_into_bands(
    batch: tuple[Array, Array, Array], count: int, band_rows: int, starts: Array, members: Array
) -> None:
    """Sort triangles stably by the bands of rows that they overlap, and by phase within a band (counting sort).

    Phase p of band b is ``members[starts[4 * b + p]:starts[4 * b + p + 1]]``. With `members` too short, only `starts`
    is written.

    Parameters
    ----------
    batch
        Boxes and source of `gather_triangles`, and the phase of the front and the back of each triangle (F, 2).
    """
    boxes, source, phase = batch
    n_bands = (len(starts) - 1) // N_PHASES
    for bucket in range(len(starts)):
        starts[bucket] = 0
    for turn in range(2):
        for i in range(count):
            own = phase[source[i], 0] if source[i] >= 0 else phase[~source[i], 1]
            if own == NOT_DRAWN:
                continue
            low: Any = np.int64(boxes[i, 2]) >> GRID_SHIFT
            high: Any = np.int64(boxes[i, 3]) >> GRID_SHIFT
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


@inlined_kernel
def edge_function(ax: Any, ay: Any, bx: Any, by: Any, px: Any, py: Any) -> Any:
    """Edge function of a directed edge at a point, lowered by one where the edge does not own its samples."""
    owns = (by < ay) | ((by == ay) & (bx > ax))  # left edges and top edges
    return (bx - ax) * (py - ay) - (by - ay) * (px - ax) - (0 if owns else 1)


@inlined_kernel
def depth_plane(camera: Array, triangles: Array, t: int, lens: Array) -> tuple[float, float, float, float, float]:
    """1/z of a triangle as a linear function of the sample position: (per column, per row, at 0, least, greatest)."""
    a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
    ax, ay, az = np.float64(camera[a, 0]), np.float64(camera[a, 1]), np.float64(camera[a, 2])
    e1x, e1y, e1z = camera[b, 0] - ax, camera[b, 1] - ay, camera[b, 2] - az
    e2x, e2y, e2z = camera[c, 0] - ax, camera[c, 1] - ay, camera[c, 2] - az
    nx, ny, nz = e1y * e2z - e1z * e2y, e1z * e2x - e1x * e2z, e1x * e2y - e1y * e2x
    distance = nx * ax + ny * ay + nz * az
    furthest = max(az, az + e1z, az + e2z)
    least, most = 1.0 / max(furthest, lens[3]), 1.0 / max(min(az, az + e1z, az + e2z), lens[3])
    edge_on = abs(distance) <= 1e-9 * (abs(nx) + abs(ny) + abs(nz)) * furthest
    inverse = 0.0 if edge_on else 1.0 / distance
    across, along = nx * inverse / lens[0], ny * inverse / lens[0]
    origin = most if edge_on else nz * inverse - across * lens[1] - along * lens[2]
    return across, along, origin, least, most


@kernel
def tile_depths(depth: Array, tiles: Array) -> None:
    """Write for each tile of samples its least 1/z: 0 where one is empty."""
    for r in range(tiles.shape[0]):
        for x in range(tiles.shape[1]):
            least = np.float32(np.inf)
            for row in range(r * TILE_SAMPLES, min((r + 1) * TILE_SAMPLES, depth.shape[0])):
                for column in range(x * TILE_SAMPLES, min((x + 1) * TILE_SAMPLES, depth.shape[1])):
                    least = min(least, depth[row, column])
            tiles[r, x] = least


@kernel
def clear_layer(depth: Array, owner: Array, layer: int) -> None:
    """Clear a layer of a band."""
    for r in range(depth.shape[1]):
        for x in range(depth.shape[2]):
            depth[layer, r, x], owner[layer, r, x] = np.float32(0), NO_TRIANGLE


@inlined_kernel
def samples_below(value: Any) -> Any:
    """Number of samples whose centres lie below a grid coordinate."""
    return (value + HALF_GRID - 1) >> GRID_SHIFT


@kernel
def draw_band(geometry: Geometry, batch: Batch, first_row: int, depth: Array, owner: Array) -> None:
    """Clear a band of rows and draw its triangles without holes, translucent ones last.

    `depth` and `owner` (3, R, W) become 1/z and triangle index of the opaque surface and of the two nearest translucent
    ones in front of it.
    """
    corners = batch.corners
    boxes = batch.boxes
    bounds = batch.bounds
    nearest_of = boxes.view(np.float32)
    n_rows, width = depth.shape[1], depth.shape[2]
    tiles = np.zeros(
        ((n_rows + TILE_SAMPLES - 1) // TILE_SAMPLES, (width + TILE_SAMPLES - 1) // TILE_SAMPLES), np.float32
    )
    clear_layer(depth, owner, 0)
    for turn in range(TRANSLUCENT + 1):
        if bounds[turn] == bounds[turn + 1]:
            continue
        if turn == LATER:
            tile_depths(depth[0], tiles)
        if turn == TRANSLUCENT:
            clear_layer(depth, owner, 1)
            clear_layer(depth, owner, 2)
        for m in range(bounds[turn], bounds[turn + 1]):
            i = batch.members[m]
            number = batch.source[i]
            t = number if number >= 0 else ~number
            left = max(samples_below(boxes[i, 0]), 0)
            right = min(samples_below(boxes[i, 1] + 1), width) - 1
            top = max(samples_below(boxes[i, 2]), first_row) - first_row
            bottom = min(samples_below(boxes[i, 3] + 1), first_row + n_rows) - 1 - first_row
            if left > right or top > bottom:
                continue
            if turn == LATER:
                nearest, hidden = nearest_of[i, 4], True
                for r in range(top // TILE_SAMPLES, bottom // TILE_SAMPLES + 1):
                    for x in range(left // TILE_SAMPLES, right // TILE_SAMPLES + 1):
                        hidden &= tiles[r, x] >= nearest
                if hidden:
                    continue
            x0, y0, x1 = np.int64(corners[i, 0]), np.int64(corners[i, 1]), np.int64(corners[i, 2])
            y1, x2, y2 = np.int64(corners[i, 3]), np.int64(corners[i, 4]), np.int64(corners[i, 5])
            across, along, origin, least, most = depth_plane(geometry.vertex, geometry.triangles, t, geometry.lens)
            bias = np.float32(1) if number >= 0 else BACK_BIAS
            px, py = left * GRID + HALF_GRID, (top + first_row) * GRID + HALF_GRID
            row_0, row_1 = edge_function(x1, y1, x2, y2, px, py), edge_function(x2, y2, x0, y0, px, py)
            row_2 = edge_function(x0, y0, x1, y1, px, py)
            right_0, right_1, right_2 = (y1 - y2) * GRID, (y2 - y0) * GRID, (y0 - y1) * GRID
            base = origin + along * (top + first_row + 0.5) + across * (left + 0.5)
            for r in range(top, bottom + 1):
                e0 = row_0
                e1 = row_1
                e2 = row_2
                value = base
                for x in range(left, right + 1):
                    if (e0 | e1 | e2) >= 0:
                        near = np.float32(min(max(value, least), most)) * bias
                        if near > depth[0, r, x]:
                            if turn < TRANSLUCENT:
                                depth[0, r, x], owner[0, r, x] = near, number
                            elif near > depth[1, r, x]:
                                depth[2, r, x], owner[2, r, x] = depth[1, r, x], owner[1, r, x]
                                depth[1, r, x], owner[1, r, x] = near, number
                            elif near > depth[2, r, x]:
                                depth[2, r, x], owner[2, r, x] = near, number
                    value += across
                    e0, e1, e2 = e0 + right_0, e1 + right_1, e2 + right_2
                base += along
                row_0, row_1 = row_0 + (x2 - x1) * GRID, row_1 + (x0 - x2) * GRID
                row_2 += (x1 - x0) * GRID
