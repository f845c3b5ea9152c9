"""Which triangle is seen at which sample: exact edge functions on a fixed grid, depth by 1/z.

Corners are snapped to 1/256 of a sample and the edge functions are integers, so that two triangles that share an edge
never both take a sample on it and never both leave it (top-left rule). Depth comes from the plane of the unsnapped
triangle, which also holds for triangles that the near plane cuts. Every kernel runs without the interpreter's lock and
on one thread: pictures are drawn side by side, so their bytes cannot depend on the number of threads. Camera space: x
right, y down, z ahead, mm. Sources: Pineda 1988 (edge functions), Olano and Greer 1997 (planes of the uncut triangle).
"""

import numpy as np
from numba import njit

SHIFT = 8
GRID = 1 << SHIFT  # steps of the snapping grid in one sample
HALF = GRID >> 1
NOTHING = np.int32(2**31 - 1)  # no triangle at this sample
BACK_BIAS = np.float32(1.0 - 3e-4)  # back faces lie 0.3 permille further away: a front face wins where both meet
N_LAYERS = 3  # the opaque surface and the two nearest translucent ones before it


@njit(cache=True, nogil=True)
def to_camera(points, view, lens, camera, grid):  # type: ignore[no-untyped-def]
    """Write camera space and snapped picture place of (V, 3) world points; the latter only beyond the near plane.

    `view` (3, 4) brings the world to camera space; `lens` is (focal length in samples, centre x, centre y, near plane).
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


@njit(cache=True, nogil=True)
def cut(camera, inside, outside, lens):  # type: ignore[no-untyped-def]
    """Snapped place where an edge meets the near plane; the same for both triangles of the edge."""
    near = lens[3]
    depth_in, depth_out = np.float64(camera[inside, 2]), np.float64(camera[outside, 2])
    share = (depth_in - near) / (depth_in - depth_out)
    right = camera[inside, 0] + share * (camera[outside, 0] - camera[inside, 0])
    down = camera[inside, 1] + share * (camera[outside, 1] - camera[inside, 1])
    column = np.int64(np.rint((lens[1] + lens[0] * right / near) * GRID))
    row = np.int64(np.rint((lens[2] + lens[0] * down / near) * GRID))
    return column, row


@njit(cache=True, nogil=True)
def area_in_picture(x0, y0, x1, y1, x2, y2, size):  # type: ignore[no-untyped-def]
    """Twice the signed area on the grid, or 0 when no sample of the picture lies inside."""
    low_x, high_x = min(x0, x1, x2), max(x0, x1, x2)
    low_y, high_y = min(y0, y1, y2), max(y0, y1, y2)
    left, right = max((low_x + HALF - 1) >> SHIFT, 0), min((high_x - HALF) >> SHIFT, size[0] - 1)
    top, bottom = max((low_y + HALF - 1) >> SHIFT, 0), min((high_y - HALF) >> SHIFT, size[1] - 1)
    if left > right or top > bottom:
        return np.int64(0)
    return (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)


@njit(cache=True, nogil=True)
def clipped(camera, grid, triangle, lens, polygon):  # type: ignore[no-untyped-def]
    """Snapped corners of the part of a triangle beyond the near plane; returns how many (0, 3 or 4)."""
    near = lens[3]
    n_corners = 0
    for c in range(3):
        here, after = triangle[c], triangle[(c + 1) % 3]
        if camera[here, 2] >= near:
            polygon[n_corners, 0], polygon[n_corners, 1] = grid[here, 0], grid[here, 1]
            n_corners += 1
            if camera[after, 2] < near:
                polygon[n_corners, 0], polygon[n_corners, 1] = cut(camera, here, after, lens)
                n_corners += 1
        elif camera[after, 2] >= near:
            polygon[n_corners, 0], polygon[n_corners, 1] = cut(camera, after, here, lens)
            n_corners += 1
    return n_corners


@njit(cache=True, nogil=True)
def gather(camera, grid, triangles, lens, size, corners, source):  # type: ignore[no-untyped-def]
    """Triangles that may be seen, as snapped corners in one winding; returns how many.

    Parameters
    ----------
    size
        (width, height) of the picture in samples.
    corners : (2 F, 6)
        Out: x, y of three corners on the grid, positive area.
    source : (2 F,)
        Out: the triangle's number t, or ~t where its back is seen.
    """
    count = 0
    polygon = np.zeros((4, 2), np.int64)
    for t in range(len(triangles)):
        n_corners = clipped(camera, grid, triangles[t], lens, polygon)
        for c in range(1, n_corners - 1):
            x0, y0, x1, y1 = polygon[0, 0], polygon[0, 1], polygon[c, 0], polygon[c, 1]
            x2, y2 = polygon[c + 1, 0], polygon[c + 1, 1]
            area = area_in_picture(x0, y0, x1, y1, x2, y2, size)
            if area == 0:
                continue
            if area < 0:  # y runs down: counter-clockwise seen from outside has negative area
                x1, y1, x2, y2 = x2, y2, x1, y1
            corners[count, 0], corners[count, 1], corners[count, 2] = x0, y0, x1
            corners[count, 3], corners[count, 4], corners[count, 5] = y1, x2, y2
            source[count] = t if area < 0 else ~t
            count += 1
    return count


@njit(cache=True, nogil=True)
def bands_of(corners, i, band_rows, n_bands):  # type: ignore[no-untyped-def]
    """First and last band of rows that a triangle touches."""
    low = np.int64(min(corners[i, 1], corners[i, 3], corners[i, 5])) >> SHIFT
    high = np.int64(max(corners[i, 1], corners[i, 3], corners[i, 5])) >> SHIFT
    return max(low // band_rows, 0), min(high // band_rows, n_bands - 1)


@njit(cache=True, nogil=True)
def sort_into_bands(corners, count, band_rows, n_bands):  # type: ignore[no-untyped-def]
    """Triangles by the bands of rows that they touch, in their own order: (starts, members) (counting sort)."""
    starts = np.zeros(n_bands + 1, np.int64)
    for i in range(count):
        low, high = bands_of(corners, i, band_rows, n_bands)
        for band in range(low, high + 1):
            starts[band + 1] += 1
    for band in range(n_bands):
        starts[band + 1] += starts[band]
    members = np.zeros(starts[n_bands], np.int32)
    at = starts[:-1].copy()
    for i in range(count):
        low, high = bands_of(corners, i, band_rows, n_bands)
        for band in range(low, high + 1):
            members[at[band]] = i
            at[band] += 1
    return starts, members


@njit(cache=True, nogil=True)
def depth_plane(camera, triangle, lens):  # type: ignore[no-untyped-def]
    """1/z of a triangle as a linear function of the sample's place: (per column, per row, at 0, least, most)."""
    a, b, c = triangle[0], triangle[1], triangle[2]
    ax, ay, az = np.float64(camera[a, 0]), np.float64(camera[a, 1]), np.float64(camera[a, 2])
    e1x, e1y, e1z = camera[b, 0] - ax, camera[b, 1] - ay, camera[b, 2] - az
    e2x, e2y, e2z = camera[c, 0] - ax, camera[c, 1] - ay, camera[c, 2] - az
    nx, ny, nz = e1y * e2z - e1z * e2y, e1z * e2x - e1x * e2z, e1x * e2y - e1y * e2x
    distance = nx * ax + ny * ay + nz * az
    most = 1.0 / max(min(az, az + e1z, az + e2z), lens[3])
    furthest = max(az, az + e1z, az + e2z)
    least = 1.0 / max(furthest, lens[3])
    if abs(distance) <= 1e-9 * (abs(nx) + abs(ny) + abs(nz)) * furthest:
        return 0.0, 0.0, most, least, most  # seen edge-on
    across, along = nx / (lens[0] * distance), ny / (lens[0] * distance)
    return across, along, nz / distance - across * lens[1] - along * lens[2], least, most


@njit(cache=True, nogil=True)
def edge(ax, ay, bx, by, px, py):  # type: ignore[no-untyped-def]
    """Edge function of a directed edge at a point, lowered by one where the edge does not own its samples."""
    value = (bx - ax) * (py - ay) - (by - ay) * (px - ax)
    owns = by < ay or (by == ay and bx > ax)  # left edges and top edges
    return value if owns else value - 1


@njit(cache=True, nogil=True)
def enter(depth, owner, layer, r, x, near, number):  # type: ignore[no-untyped-def]
    """Put a sample of a triangle where its depth belongs."""
    if near <= depth[0, r, x]:
        return
    if layer == 0:
        depth[0, r, x], owner[0, r, x] = near, number
    elif near > depth[1, r, x]:
        depth[2, r, x], owner[2, r, x] = depth[1, r, x], owner[1, r, x]
        depth[1, r, x], owner[1, r, x] = near, number
    elif near > depth[2, r, x]:
        depth[2, r, x], owner[2, r, x] = near, number


@njit(cache=True, nogil=True)
def draw_triangle(corner, number, layer, plane, first_row, depth, owner):  # type: ignore[no-untyped-def]
    """Enter one triangle into a band's samples.

    Parameters
    ----------
    corner : (6,)
        Snapped corners with positive area.
    number
        What `owner` shall hold.
    layer
        0: opaque; 1: translucent, to be drawn after everything opaque.
    plane
        Of `depth_plane`.
    first_row
        The band's first row of samples.
    depth, owner : (3, R, W)
        1/z and number of the opaque surface and of the two nearest translucent ones before it.
    """
    x0, y0, x1 = np.int64(corner[0]), np.int64(corner[1]), np.int64(corner[2])
    y1, x2, y2 = np.int64(corner[3]), np.int64(corner[4]), np.int64(corner[5])
    left = max((min(x0, x1, x2) + HALF - 1) >> SHIFT, 0)
    right = min((max(x0, x1, x2) - HALF) >> SHIFT, depth.shape[2] - 1)
    top = max((min(y0, y1, y2) + HALF - 1) >> SHIFT, first_row)
    bottom = min((max(y0, y1, y2) - HALF) >> SHIFT, first_row + depth.shape[1] - 1)
    px, py = (left << SHIFT) + HALF, (top << SHIFT) + HALF
    row_0, row_1, row_2 = edge(x1, y1, x2, y2, px, py), edge(x2, y2, x0, y0, px, py), edge(x0, y0, x1, y1, px, py)
    across, along, origin, least, most = plane
    bias = np.float32(1.0) if number >= 0 else BACK_BIAS
    for y in range(top, bottom + 1):
        e0, e1, e2 = row_0, row_1, row_2
        base = origin + along * (y + 0.5) + across * (left + 0.5)
        for x in range(left, right + 1):
            if (e0 | e1 | e2) >= 0:
                near = np.float32(min(max(base, least), most)) * bias
                enter(depth, owner, layer, y - first_row, x, near, number)
            base += across
            e0, e1, e2 = e0 - ((y2 - y1) << SHIFT), e1 - ((y0 - y2) << SHIFT), e2 - ((y1 - y0) << SHIFT)
        row_0, row_1 = row_0 + ((x2 - x1) << SHIFT), row_1 + ((x0 - x2) << SHIFT)
        row_2 += (x1 - x0) << SHIFT


@njit(cache=True, nogil=True)
def draw_band(camera, triangles, lens, translucent, batch, first_row, depth, owner):  # type: ignore[no-untyped-def]
    """Clear a band of rows and draw its triangles, first the opaque ones; returns how many are translucent.

    `translucent` (F,) marks triangles; `batch` is (corners, source, members) of this band.
    """
    corners, source, members = batch
    depth[:] = 0
    owner[:] = NOTHING
    n_translucent = 0
    for layer in range(2):
        if layer == 1 and n_translucent == 0:
            break
        for i in members:
            number = source[i]
            t = number if number >= 0 else ~number
            if translucent[t] == layer:
                plane = depth_plane(camera, triangles[t], lens)
                draw_triangle(corners[i], number, layer, plane, first_row, depth, owner)
            elif layer == 0:
                n_translucent += 1
    return n_translucent
