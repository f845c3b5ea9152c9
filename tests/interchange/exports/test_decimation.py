"""Decimation keeps a surface within its tolerance, its borders, its closedness and what triangles interpolate."""

import numpy as np
import pytest

from tts2face.interchange.exports.decimation import decimate


def grid(n):
    """A square of n x n vertices, 1 mm apart, and its triangles."""
    y, x = np.mgrid[0:n, 0:n]
    at = np.arange(n * n).reshape(n, n)
    a, b, c, d = (one.ravel() for one in (at[:-1, :-1], at[:-1, 1:], at[1:, :-1], at[1:, 1:]))
    triangles = np.concatenate([np.column_stack([a, b, d]), np.column_stack([a, d, c])])
    return np.column_stack([x.ravel(), y.ravel(), np.zeros(n * n)]).astype(float), triangles


def area(points, triangles):
    a, b, c = (points[corner, :3] for corner in triangles.T)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2


def sphere(n, radius):
    """A closed sphere of n vertices (Fibonacci lattice) and its triangles, which face outwards."""
    from scipy.spatial import ConvexHull

    height = 1 - (2 * np.arange(n) + 1) / n
    around, level = np.arange(n) * np.pi * (3 - np.sqrt(5)), np.sqrt(1 - height**2)
    points = radius * np.column_stack([level * np.cos(around), height, level * np.sin(around)])
    triangles = ConvexHull(points).simplices
    a, b, c = (points[corner] for corner in triangles.T)
    inwards = (np.cross(b - a, c - a) * a).sum(axis=1) < 0
    triangles[inwards] = triangles[inwards][:, ::-1]
    return points, triangles.astype(np.int64)


def test_plane_keeps_its_border_with_few_triangles():
    points, triangles = grid(20)
    fewer = decimate(points, triangles, np.full(len(points), 0.01))
    assert len(fewer) < len(triangles) / 6
    assert area(points, fewer) == pytest.approx(area(points, triangles), rel=1e-9)


def test_sphere_stays_closed_and_within_its_tolerance():
    points, triangles = sphere(1500, 50.0)
    fewer = decimate(points, triangles, np.full(len(points), 0.5))
    assert len(fewer) < len(triangles) / 3
    edges = np.sort(np.concatenate([fewer[:, [0, 1]], fewer[:, [1, 2]], fewer[:, [2, 0]]]), axis=1)
    assert set(np.unique(edges, axis=0, return_counts=True)[1]) == {2}
    corners = points[fewer]
    assert (np.linalg.norm(corners.mean(axis=1), axis=1) > 50 - 4 * 0.5).all()
    assert (
        (np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) * corners[:, 0]).sum(axis=1) > 0
    ).all()


def test_a_number_that_bends_keeps_its_vertices():
    points, triangles = grid(20)
    bent = np.column_stack([points, np.abs(points[:, 0] - 10)])
    fewer = decimate(bent, triangles, np.full(len(points), 0.02))
    corners = bent[fewer][:, :, [0, 3]]
    middle = corners.mean(axis=1)
    assert middle[:, 1] == pytest.approx(np.abs(middle[:, 0] - 10), abs=0.3)
    assert len(fewer) < 120


def test_vertices_stay_where_the_tolerance_is_least():
    points, triangles = sphere(1500, 50.0)
    upper = points[:, 1] > 0
    fewer = decimate(points, triangles, np.where(upper, 0.02, 2.0))
    kept = np.unique(fewer)
    assert upper[kept].sum() > 5 * (~upper[kept]).sum()


def test_vertices_of_a_seam_stay():
    points, triangles = grid(10)
    seam = points[:, 0] == 5
    twins = np.flatnonzero(seam)
    copies = dict(zip(twins.tolist(), range(len(points), len(points) + len(twins)), strict=True))
    right = points[triangles, 0].mean(axis=1) > 5
    triangles[right] = np.vectorize(lambda v: copies.get(v, v))(triangles[right])
    points = np.concatenate([points, points[twins]])
    kept = set(np.unique(decimate(points, triangles, np.full(len(points), 1.0))).tolist())
    assert kept >= set(twins.tolist()) | set(copies.values())


def test_arrays_that_do_not_fit_are_refused():
    points, triangles = grid(3)
    with pytest.raises(ValueError, match="do not fit each other"):
        decimate(points, triangles, np.ones(2))
