"""Subdivision of meshes of quads and triangles."""

import numpy as np

from corpus_tools.shipped.head.subdivision import catmull_clark, triangulate

CUBE = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
SIDES = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])


def sheet(n):
    """Vertices and quads of a flat n x n sheet."""
    x, y = np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0), indexing="ij")
    at = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    quads = np.stack([at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]], axis=-1).reshape(-1, 4)
    return np.column_stack([x.ravel(), y.ravel(), 0 * x.ravel()]), quads


def by_the_paper(vertices, quads):
    """Catmull and Clark's rules one vertex at a time, for closed meshes."""
    centre = [vertices[quad].mean(axis=0) for quad in quads]
    sides = {}
    for number, quad in enumerate(quads):
        for k in range(4):
            sides.setdefault(frozenset((int(quad[k]), int(quad[(k + 1) % 4]))), []).append(number)
    edge_points = {
        side: (sum(vertices[v] for v in side) + sum(centre[f] for f in faces)) / 4 for side, faces in sides.items()
    }
    new = []
    for v in range(len(vertices)):
        around = [centre[f] for f, quad in enumerate(quads) if v in quad]
        middles = [vertices[list(side)].mean(axis=0) for side in sides if v in side]
        n = len(around)
        new.append((np.mean(around, axis=0) + 2 * np.mean(middles, axis=0) + (n - 3) * vertices[v]) / n)
    return np.array([*new, *edge_points.values(), *centre])


def test_a_subdivided_cube_equals_the_published_result():
    matrix, quads = catmull_clark(8, SIDES)
    expected = by_the_paper(CUBE, SIDES)
    found = matrix @ CUBE
    assert len(quads) == 24
    off = np.linalg.norm(found[:, None] - expected[None], axis=2)
    assert found.shape == expected.shape
    assert off.min(axis=1).max() < 1e-12
    assert len(np.unique(off.argmin(axis=1))) == len(expected)


def test_every_new_point_is_an_average():
    matrix, _ = catmull_clark(8, SIDES)
    assert np.allclose(np.asarray(matrix.sum(axis=1)).ravel(), 1.0, rtol=1e-12)
    assert matrix.min() >= 0


def test_a_flat_sheet_stays_flat_and_its_border_stays_on_its_line():
    vertices, quads = sheet(3)
    matrix, fine = catmull_clark(len(vertices), quads)
    found = matrix @ vertices
    sides = np.sort(np.stack([fine, np.roll(fine, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    lines, uses = np.unique(sides, axis=0, return_counts=True)
    rim = np.unique(lines[uses == 1])
    assert np.all(found[:, 2] == 0)
    assert len(rim) == 24
    straight = [v for v in rim if np.min(np.abs(found[v][:2])) < 1e-12 or np.max(found[v][:2]) > 3 - 1e-12]
    assert len(straight) == 24 - 4  # the corners round off


def test_quads_keep_their_winding_and_first_corner():
    _, quads = catmull_clark(8, SIDES)
    assert np.array_equal(quads[:, 0].reshape(6, 4), SIDES)
    vertices, flat = sheet(2)
    matrix, fine = catmull_clark(len(vertices), flat)
    corners = (matrix @ vertices)[triangulate(fine)]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.all(normals[:, 2] > 0)
