"""The rasteriser against slow exact ones: every sample against every triangle, in whole numbers and fractions."""

from fractions import Fraction

import numpy as np
import pytest
from scipy.spatial import Delaunay

from tts2face.picture.kernels.raster import (
    BACK_BIAS,
    FIRST,
    GRID,
    LATER,
    N_PHASES,
    NO_TRIANGLE,
    TRANSLUCENT,
    Batch,
    Geometry,
    draw_band,
    gather_triangles,
    sort_into_bands,
    transform_to_camera,
)

LENS = np.array([60.0, 20.0, 15.0, 5.0])  # focal length, centre x, centre y in samples; near plane in mm
VIEW = np.eye(3, 4)  # the world is camera space
SIZE = (40, 30)


def rasterised(points, triangles, translucent=None, band_rows=SIZE[1]):
    """(3, H, W) owner and depth of the kernels."""
    points = np.asarray(points, np.float32)
    camera, grid = np.zeros((len(points), 3), np.float32), np.zeros((len(points), 2), np.int32)
    transform_to_camera(points, VIEW, LENS, camera, grid)
    triangles = np.asarray(triangles, np.int32)
    corners, source = np.zeros((2 * len(triangles), 6), np.int32), np.zeros(2 * len(triangles), np.int32)
    boxes = np.zeros((2 * len(triangles), 5), np.int32)
    count = gather_triangles(camera, grid, triangles, (LENS, SIZE), (corners, boxes, source))
    n_bands = -(-SIZE[1] // band_rows)
    starts, members = np.zeros(n_bands * N_PHASES + 1, np.int64), np.zeros(n_bands * 2 * len(triangles), np.int32)
    marks = np.zeros(len(triangles), bool) if translucent is None else np.asarray(translucent, bool)
    phase = np.where(marks[:, None], TRANSLUCENT, np.array([FIRST, LATER])).astype(np.int8)
    sort_into_bands((boxes, source, phase), count, band_rows, starts, members)
    owner, depth = [], []
    for band in range(n_bands):
        near, who = (
            np.zeros((3, band_rows, SIZE[0]), np.float32),
            np.full((3, band_rows, SIZE[0]), NO_TRIANGLE, np.int32),
        )
        bounds = starts[N_PHASES * band : N_PHASES * (band + 1) + 1]
        batch = Batch(corners, boxes, source, members, bounds)
        draw_band(Geometry(camera, triangles, LENS), batch, band * band_rows, near, who)
        owner.append(who)
        depth.append(near)
    return np.concatenate(owner, axis=1)[:, : SIZE[1]], np.concatenate(depth, axis=1)[:, : SIZE[1]]


def snapped(point):
    """Exact place on the grid of a point of camera space."""
    x, y, z = (float(np.float32(value)) for value in point)
    return tuple(
        int(np.rint((LENS[1 + axis] + LENS[0] * value / z) * GRID)) for axis, value in enumerate((x, y))
    )  # fmt: skip


def owns(corners, column, row):
    """Whether a sample moved by an infinitely small step right, and one far smaller down, lies strictly inside."""
    px, py = column * GRID + GRID // 2, row * GRID + GRID // 2
    signs = set()
    for (ax, ay), (bx, by) in zip(corners, corners[1:] + corners[:1], strict=True):
        edge = ((bx - ax) * (py - ay) - (by - ay) * (px - ax), ay - by, bx - ax)
        first = next((value for value in edge if value), 0)
        signs.add((first > 0) - (first < 0))
    return signs in ({1}, {-1})


def inverse_depth(corners, column, row):
    """Exact 1/z of the plane of three points where a sample's ray meets it; None where it does not."""
    a, b, c = ([Fraction(float(np.float32(value))) for value in corner] for corner in corners)
    u, v = [q - p for p, q in zip(a, b, strict=True)], [q - p for p, q in zip(a, c, strict=True)]
    normal = (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])
    ray = (
        (Fraction(column) + Fraction(1, 2) - Fraction(LENS[1])) / Fraction(LENS[0]),
        (Fraction(row) + Fraction(1, 2) - Fraction(LENS[2])) / Fraction(LENS[0]),
        Fraction(1),
    )
    level = sum(n * p for n, p in zip(normal, a, strict=True))
    return None if level == 0 else sum(n * r for n, r in zip(normal, ray, strict=True)) / level


@pytest.mark.parametrize("seed", range(6))
def test_random_triangles_are_those_of_the_slow_rasteriser(seed):
    rng = np.random.default_rng(seed)
    points = np.column_stack([rng.uniform(-40, 40, (30, 2)), rng.uniform(60, 140, 30)]).astype(np.float32)
    triangles = rng.permutation(30).reshape(10, 3)
    owner, _ = rasterised(points, triangles, band_rows=7)
    for row in range(SIZE[1]):
        for column in range(SIZE[0]):
            found = []
            for number, triangle in enumerate(triangles):
                corners = [snapped(points[v]) for v in triangle]
                if not owns(corners, column, row):
                    continue
                (ax, ay), (bx, by), (cx, cy) = corners
                back = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay) > 0
                near = inverse_depth(points[triangle], column, row)
                found.append((float(near) * (float(BACK_BIAS) if back else 1.0), ~number if back else number))
            found.sort(reverse=True)
            if len(found) > 1 and found[0][0] - found[1][0] < 1e-6 * found[0][0]:
                continue  # closer than single precision resolves
            assert owner[0, row, column] == (found[0][1] if found else NO_TRIANGLE)


@pytest.mark.parametrize("seed", range(4))
def test_every_sample_of_a_mesh_is_drawn_exactly_once(seed):
    rng = np.random.default_rng(seed)
    places = rng.integers(-2, 2 * SIZE[0], (60, 2)) / 2.0  # many corners and edges run through the middle of samples
    places = np.unique(np.vstack([places, [[-5, -5], [60, -5], [60, 50], [-5, 50]]]), axis=0)
    points = np.column_stack([(places - LENS[1:3]) * 90 / LENS[0], np.full(len(places), 90.0)])
    triangles = Delaunay(places).simplices
    drawn = sum((rasterised(points, [triangle])[0][0] != NO_TRIANGLE).astype(int) for triangle in triangles)
    np.testing.assert_array_equal(drawn, 1)


def test_triangles_are_clipped_at_the_near_plane():
    rng = np.random.default_rng(3)
    for _ in range(20):
        points = np.column_stack([rng.uniform(-15, 15, (3, 2)), rng.uniform(-30, 60, 3)])
        owner, depth = rasterised(points, [[0, 1, 2]])
        corners = points.astype(np.float32).astype(float)
        for row in range(0, SIZE[1], 3):
            for column in range(0, SIZE[0], 3):
                ray = np.array([(column + 0.5 - LENS[1]) / LENS[0], (row + 0.5 - LENS[2]) / LENS[0], 1.0])
                shares = np.linalg.solve(corners.T, ray)  # of the corners, on the ray
                z = 1 / shares.sum() if abs(shares.sum()) > 1e-12 else np.inf
                weights = shares * z
                if min(*np.abs(weights), abs(z - LENS[3]) / 10) < 0.03:
                    continue  # on an edge, up to the snapping
                inside = bool((weights > 0).all()) and z > LENS[3]
                assert (owner[0, row, column] != NO_TRIANGLE) == inside
                if inside:
                    assert depth[0, row, column] == pytest.approx(1 / z, rel=1e-3)


def test_two_translucent_layers_are_kept_in_order_before_the_opaque_one():
    square = np.array([[-30, -30], [30, -30], [30, 30], [-30, 30]], float)
    points = np.vstack([np.column_stack([square, np.full(4, z)]) for z in (80, 50, 60, 70, 120)])
    triangles = [[k + a, k + b, k + c] for k in range(0, 20, 4) for a, b, c in ((0, 1, 2), (0, 2, 3))]
    owner, _ = rasterised(points, triangles, translucent=[0, 0, 1, 1, 1, 1, 1, 1, 1, 1])
    layers = np.unique(np.where(owner < 0, ~owner, owner) // 2, axis=1)
    assert {int(layer) for layer in layers[0].ravel()} == {0}
    assert {int(layer) for layer in layers[1].ravel()} == {1}
    assert {int(layer) for layer in layers[2].ravel()} == {2}


def test_bands_of_any_height_give_the_same_picture():
    rng = np.random.default_rng(9)
    points = np.column_stack([rng.uniform(-40, 40, (60, 2)), rng.uniform(60, 140, 60)])
    triangles = rng.permutation(60).reshape(20, 3)
    whole, _ = rasterised(points, triangles)
    for rows in (1, 4, 11):
        np.testing.assert_array_equal(rasterised(points, triangles, band_rows=rows)[0], whole)
