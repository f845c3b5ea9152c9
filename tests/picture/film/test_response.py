"""Terms on which the light of a vertex depends."""

import numpy as np
import pytest

from tests.picture.film.lit_face import lit_tiny_face
from tts2face.face.deformation import build_rig
from tts2face.models.baked_light import LIP_RING, N_MOUTH_TERMS, N_TERMS
from tts2face.picture.baked.response import (
    GAP_MM,
    MOVE_MM,
    LightTerms,
    add_responses,
    light_terms,
    still_eyes,
    write_mouth_terms,
)
from tts2face.picture.kernels.tables import NORMAL

FACE = lit_tiny_face()
RIG = build_rig(FACE)


def terms_of(made: LightTerms, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    buffers = made.allocate_buffers()
    made.update(points.astype(np.float32), buffers)
    return buffers.terms, buffers.mouth


def test_terms_are_those_of_rest_and_movement() -> None:
    made = light_terms(FACE, RIG, FACE.light.baked)
    rest, _ = terms_of(made, FACE.vertices)
    assert rest.shape == (N_TERMS, len(FACE.light.baked.rows) + len(FACE.light.baked.ball_rows))
    assert (rest[0] == 1).all()
    assert np.abs(rest[1:]).max() < 1e-5
    moved, _ = terms_of(made, FACE.vertices + np.float32([0, 4, 0]))
    assert moved[5] == pytest.approx(4 / MOVE_MM, abs=1e-4)
    assert np.abs(np.delete(moved[1:], 4, axis=0)).max() < 1e-4


def test_normals_turn_across_a_seam_of_the_texture_alike() -> None:
    made = light_terms(FACE, RIG, FACE.light.baked)
    turn = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]], np.float32)  # by 90 degrees about z
    centre = np.array([0, -20, -60], np.float32)
    skin = slice(0, len(FACE.light.baked.rows))
    turned = FACE.vertices.copy()
    turned[made.source[skin]] = (turned[made.source[skin]] - centre) @ turn.T + centre
    found, _ = terms_of(made, turned)
    outward = (FACE.vertices[made.source[skin]] - centre) / 90
    change = found[1:4, skin].T
    assert change == pytest.approx(outward @ turn.T - outward, abs=0.06)


def test_a_partner_shows_how_far_lips_are_open() -> None:
    upper, lower = (int(FACE.landmark_vertices[LIP_RING.index(number), 0]) for number in (13, 14))
    rows, partners = np.array([upper], np.int32), np.array([lower], np.int32)
    made = LightTerms.of_rows(FACE, RIG, rows, partners, np.zeros(0, np.int32))
    apart = FACE.vertices[upper] - FACE.vertices[lower]
    for drop in (0.0, 3.0, 30.0):
        points = FACE.vertices.copy()
        points[lower, 1] -= drop
        way = apart + np.array([0, drop, 0])
        expected = way / (GAP_MM + np.linalg.norm(way)) - apart / (GAP_MM + np.linalg.norm(apart))
        assert terms_of(made, points)[0][7:, 0] == pytest.approx(expected, abs=1e-4)


def test_the_light_through_an_opening_is_its_form_factor() -> None:
    """Against the sum over small pieces of the opening: cosines at both ends over pi and squared distance."""
    depth, half = 12.0, 9.0
    around = np.linspace(-np.pi, np.pi, len(LIP_RING), endpoint=False)
    ring = np.column_stack([-half * np.cos(-around), half * np.sin(around), np.full(len(around), depth)])
    face_points = np.zeros((len(LIP_RING) + 1, 3), np.float32)
    face_points[1:] = ring[::-1]
    table = np.zeros((1, NORMAL + 3), np.float32)
    tilt = np.radians(20)
    table[0, NORMAL:] = (0, np.sin(tilt), np.cos(tilt))
    terms = np.ones((N_MOUTH_TERMS, 1), np.float32)
    write_mouth_terms(face_points, np.zeros(1, np.int32), table, face_points[1:], terms, np.zeros((6, 1), np.float32))
    step = half / 400
    across, up = np.meshgrid(np.arange(-half, half, step) + step / 2, np.arange(-half, half, step) + step / 2)
    inside = polygon_holds(ring[:, :2], across, up)
    squared = across**2 + up**2 + depth**2
    ahead, above = (step**2 * inside * depth * part / (np.pi * squared**2) for part in (depth, up))
    factor = (np.cos(tilt) * ahead + np.sin(tilt) * above).sum()
    assert abs(terms[1, 0]) == pytest.approx(factor, rel=0.01)
    assert abs(terms[5, 0]) == pytest.approx(ahead.sum(), rel=0.01)
    assert terms[2, 0] ** 2 == pytest.approx(max(terms[1, 0], 0), abs=1e-5)


def polygon_holds(corners: np.ndarray, across: np.ndarray, up: np.ndarray) -> np.ndarray:
    """Whether points lie in a convex polygon."""
    sides = []
    for (x, y), (other_x, other_y) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        sides.append((other_x - x) * (up - y) - (other_y - y) * (across - x))
    held: np.ndarray = np.all(np.array(sides) > 0, axis=0) | np.all(np.array(sides) < 0, axis=0)
    return held


def test_the_mouth_is_lit_from_in_front_and_more_when_it_opens() -> None:
    made = light_terms(FACE, RIG, FACE.light.baked)
    _, shut = terms_of(made, FACE.vertices)
    points = FACE.vertices.copy()
    ring = FACE.landmark_vertices[:, 0]
    lower = ring[FACE.vertices[ring, 1] < -52]
    points[lower, 1] -= 15
    _, opened = terms_of(made, points)
    behind = FACE.vertices[made.mouth, 2] < FACE.vertices[ring, 2].min() - 4
    assert behind.sum() > 10
    assert (shut[5, behind] > 0).all()
    assert (opened[5, behind] > shut[5, behind]).all()


def test_light_stays_within_what_was_baked() -> None:
    base, out = np.array([[100], [50], [20]], np.float32), np.zeros((3, 1), np.float32)
    responses = np.zeros((2, 3, 1), np.int8)
    responses[1] = 10
    limits = np.array([-20, 15], np.int8)[:, None, None] * np.ones((1, 3, 1), np.int8)
    for term, change in ((1.0, 5.0), (100.0, 30.0), (-100.0, -40.0)):
        terms = np.array([[1, 1], [0, term]], np.float32)
        sizes = np.array([1, 0.5], np.float32)
        add_responses(base, (responses, sizes, limits), terms, (0, 1), out)
        assert out == pytest.approx(base + change)


def test_eyes_look_ahead_in_the_light() -> None:
    points = RIG.deform(np.array([0, 0, 1, 1], np.float32))
    ball = slice(FACE.eyes[0].first, FACE.eyes[0].first + FACE.eyes[0].count)
    assert np.abs(points[ball] - FACE.vertices[ball]).max() > 1
    still_eyes(FACE, points)
    assert (points[ball] == FACE.vertices[ball]).all()
