"""Inner lips on the mesh: misread landmarks come back to where the lips touch."""

from functools import cache

import numpy as np
import pytest

from tts2face.face.landmarks import landmark_positions, scatter_landmarks
from tts2face.face.shape_transfer import default_head
from tts2face.interchange.characters.lip_line import COLUMNS, _cross_section, find_lip_line
from tts2face.interchange.characters.surface_points import SurfacePoints, nearest_points
from tts2face.models.landmarks import (
    INNER_LIP_LOWER,
    INNER_LIP_UPPER,
    MOUTH_CORNER_LEFT,
    MOUTH_CORNER_RIGHT,
    N_MESH_LANDMARKS,
)

UPPER, LOWER = list(INNER_LIP_UPPER[1:-1]), list(INNER_LIP_LOWER[1:-1])
TOUCHING_MM = 0.1


@cache
def head_skin() -> tuple[SurfacePoints, np.ndarray, np.ndarray, np.ndarray]:
    """Landmarks, vertices and skin of the shipped head, and its open jaw."""
    head = default_head()
    order = np.argsort(head.landmarks)[:N_MESH_LANDMARKS]
    points = SurfacePoints(head.landmark_vertices[order].astype(np.int64), head.landmark_weights[order].astype(float))
    skin = head.parts[0]
    triangles = head.triangles[skin.first : skin.first + skin.count].astype(np.int64)
    return points, head.vertices.astype(float), triangles, head.shapes[head.shape_names.index("jawOpen")].astype(float)


def misread(seed: int, error_mm: float) -> SurfacePoints:
    """Landmarks whose inner lips are off by some millimetres on the skin."""
    points, vertices, triangles, _ = head_skin()
    places = points.places(vertices)
    numbers = [*UPPER, *LOWER]
    places[numbers] += np.random.default_rng(seed).normal(0.0, error_mm, (len(numbers), 3))
    off = nearest_points(places[numbers], vertices, triangles)
    found = SurfacePoints(points.vertices.copy(), points.weights.copy())
    found.vertices[numbers], found.weights[numbers] = off.vertices, off.weights
    return found


@pytest.mark.parametrize("seed", range(3))
def test_misread_lips_touch_again_and_face_each_other(seed: int) -> None:
    _, vertices, triangles, opened = head_skin()
    start = misread(seed, 1.5)
    assert np.abs(start.places(vertices)[UPPER] - start.places(vertices)[LOWER]).max() > 1.0
    found = find_lip_line(start, vertices, triangles, opened)
    places, moved = found.places(vertices), found.places(opened)
    assert np.linalg.norm(places[UPPER] - places[LOWER], axis=1).max() < TOUCHING_MM
    left, right = places[MOUTH_CORNER_LEFT, 0], places[MOUTH_CORNER_RIGHT, 0]
    np.testing.assert_allclose(places[UPPER, 0], (left + right) / 2 + abs(left - right) / 2 * COLUMNS[1:-1], atol=0.01)
    assert (moved[UPPER, 1] - moved[LOWER, 1] > 8.0).all()  # one on each lip
    truth = scatter_landmarks(default_head(), landmark_positions(default_head()))
    assert np.abs(places[13] - truth[13]).max() < 0.6


def test_only_inner_lips_move() -> None:
    _, vertices, triangles, opened = head_skin()
    start = misread(0, 1.5)
    found = find_lip_line(start, vertices, triangles, opened)
    others = np.setdiff1d(np.arange(N_MESH_LANDMARKS), [*UPPER, *LOWER])
    np.testing.assert_array_equal(found.vertices[others], start.vertices[others])


def test_lips_that_stand_apart_keep_their_gap() -> None:
    """A mouth open at rest by some millimetres: the nearest points of the lips, not the inside of the mouth."""
    points, vertices, triangles, opened = head_skin()
    apart = vertices + 0.1 * opened
    found = find_lip_line(points, apart, triangles, opened)
    places = found.places(apart)
    gap = 0.1 * (points.places(opened)[13, 1] - points.places(opened)[14, 1])
    assert places[13, 1] - places[14, 1] == pytest.approx(gap, abs=0.6)
    assert places[[13, 14], 2].min() > 24.0  # mm: the back of the mouth lies behind


def test_a_shape_that_parts_no_lips_leaves_the_landmarks() -> None:
    _, vertices, triangles, opened = head_skin()
    start = misread(1, 1.5)
    found = find_lip_line(start, vertices, triangles, 0.01 * opened)
    np.testing.assert_array_equal(found.vertices, start.vertices)


def test_a_cross_section_is_that_of_a_cube() -> None:
    """Against the perimeter of a square, cut at a third of the cube."""
    corners = np.array([[x, y, z] for x in (0.0, 3.0) for y in (0.0, 2.0) for z in (0.0, 2.0)])
    squares = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    triangles = np.array([pick for a, b, c, d in squares for pick in ((a, b, c), (a, c, d))])
    points = _cross_section(corners, triangles, 1.0, 0.05)
    places = points.places(corners)
    np.testing.assert_allclose(places[:, 0], 1.0)
    on_border = np.isclose(np.abs(places[:, 1:] - 1.0).max(axis=1), 1.0)
    assert on_border.all()
    assert len(np.unique(np.round(places[:, 1:], 3), axis=0)) > 8.0 / 0.05 * 0.95
