"""The nearest triangle of each sample, compared with exact arithmetic on each triangle."""

import numpy as np
import pytest

from tts2face.numeric.kernels import BLOCK
from tts2face.picture.baked.visibility import (
    N_COLUMNS,
    N_SPAN_VALUES,
    NEAR,
    TRIANGLE_MASK,
    X,
    Y,
    fill_bands,
    find_bands,
    find_nearest,
    nearest_triangles,
    project,
)

SIDE = 48


def table_of(points):
    table = np.zeros((len(points), N_COLUMNS), np.float32)
    table[:, [X, Y, NEAR]] = points
    return table


def nearest_of(points, triangles, size=(SIDE, SIDE)):
    nearest, first, end = nearest_triangles(table_of(points), np.array(triangles, np.int32), size)
    assert 0 <= first <= end <= size[1]
    assert not nearest[:, :first].any()
    assert not nearest[:, end:].any()
    return (nearest[:, : size[1]] & TRIANGLE_MASK) - 1


def exact(points, triangles):
    """Nearest triangle of each sample, and how far each sample lies from the edges of all triangles."""
    x, y = np.meshgrid(np.arange(SIDE, dtype=float), np.arange(SIDE, dtype=float))
    best, found, off = np.zeros((SIDE, SIDE)), np.full((SIDE, SIDE), -1), np.full((SIDE, SIDE), np.inf)
    for number, corners in enumerate(triangles):
        a, b, c = points[corners].astype(float)
        area = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])
        if area >= 0:
            continue
        inside, depth = np.full((SIDE, SIDE), np.inf), np.zeros((SIDE, SIDE))
        for p, q, opposite in ((b, c, a), (c, a, b), (a, b, c)):
            share = ((q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0])) / area
            inside = np.minimum(inside, share)
            depth += share * opposite[2]
            off = np.minimum(off, np.abs(share) * abs(area) / np.hypot(*(q - p)[:2]))
        wins = (inside >= 0) & (depth > best)
        best[wins], found[wins] = depth[wins], number
    return found, off


@pytest.mark.parametrize("scale", [6.0, 60.0])
def test_each_sample_has_the_nearest_triangle_that_faces_the_camera(scale: float) -> None:
    rng = np.random.default_rng(3)
    middle = rng.uniform(-5, SIDE + 5, (200, 1, 2))
    places = (middle + rng.normal(0, scale, (200, 3, 2))).reshape(-1, 2)
    points = np.column_stack([places, rng.uniform(0.5e-3, 2e-3, len(places))]).astype(np.float32)
    triangles = np.arange(600).reshape(-1, 3)
    expected, off = exact(points, triangles)
    clear = off > 0.01
    assert clear.mean() > 0.3
    assert (nearest_of(points, triangles)[clear] == expected[clear]).all()


@pytest.mark.parametrize("rows", [1, 7, SIDE])
def test_bands_of_rows_show_what_the_whole_picture_shows(rows: int) -> None:
    rng = np.random.default_rng(4)
    places = (rng.uniform(-5, SIDE + 5, (200, 1, 2)) + rng.normal(0, 9, (200, 3, 2))).reshape(-1, 2)
    table = table_of(np.column_stack([places, rng.uniform(0.5e-3, 2e-3, len(places))]))
    triangles = np.arange(600, dtype=np.int32).reshape(-1, 3)
    whole, first, end = nearest_triangles(table, triangles, (SIDE, SIDE))
    bands, counts = np.zeros((200, 2), np.int16), np.zeros(-(-SIDE // rows), np.int64)
    find_bands(table, triangles, (SIDE, rows), bands, counts)
    ends = np.cumsum(counts)
    order = np.zeros(ends[-1], np.int32)
    fill_bands(bands, ends.copy(), order)
    assert len(order) < len(counts) * 200
    shown = np.zeros(N_SPAN_VALUES, np.int64)
    edges = []
    for number, near in enumerate(np.split(order, ends[:-1])):
        assert (np.diff(near) > 0).all()
        band = np.full((min(rows, SIDE - number * rows), SIDE + BLOCK), -1, np.int64)
        edges.append(find_nearest(table, triangles, near, number * rows, band, shown))
        np.testing.assert_array_equal(band, whole[number * rows : (number + 1) * rows])
    assert min(edge[0] for edge in edges) == first
    assert max(edge[1] for edge in edges) == end


def test_no_sample_falls_between_triangles_that_share_edges() -> None:
    rng = np.random.default_rng(5)
    n = 20
    x, y = np.meshgrid(np.linspace(-3, SIDE + 2, n), np.linspace(-3, SIDE + 2, n))
    inner = (slice(1, -1), slice(1, -1))
    for grid in (x, y):
        grid[inner] += rng.uniform(-0.8, 0.8, (n - 2, n - 2))
    points = np.column_stack([x.ravel(), y.ravel(), np.full(n * n, 1e-3)]).astype(np.float32)
    corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    triangles = np.concatenate(
        [np.stack([corner, corner + n, corner + 1], 1), np.stack([corner + 1, corner + n, corner + n + 1], 1)]
    )
    assert (nearest_of(points, triangles) >= 0).all()
    points[:, :2] = np.rint(points[:, :2])  # corners and edges on samples
    assert (nearest_of(points, triangles) >= 0).all()


def test_backs_slivers_and_what_is_too_near_are_not_drawn() -> None:
    points = np.array([[1, 1, 1e-3], [1, 40, 1e-3], [40, 1, 1e-3]], np.float32)
    assert (nearest_of(points, [[0, 1, 2]]) == 0).sum() == 40 * 41 / 2  # with those on its edges
    assert (nearest_of(points, [[2, 1, 0]]) == -1).all()
    assert (nearest_of(points, [[0, 1, 1]]) == -1).all()
    points[1, 2] = 0.0  # nearer than the near plane
    assert (nearest_of(points, [[0, 1, 2]]) == -1).all()


def test_points_are_projected_to_samples_with_their_inverse_depth() -> None:
    view = np.column_stack([np.eye(3), [0, 0, 100]]).astype(np.float32)
    lens = np.array([500, 32, 24, 10], np.float32)
    points = np.array([[0, 0, 0], [10, -4, 0], [0, 0, -95]], np.float32)
    table = np.zeros((3, N_COLUMNS), np.float32)
    project(points, np.array([2, 0, 1], np.int32), view, lens, table)
    assert table[1, [X, Y, NEAR]] == pytest.approx([31.5, 23.5, 0.01])
    assert table[2, [X, Y, NEAR]] == pytest.approx([81.5, 3.5, 0.01])
    assert table[0, NEAR] == 0
