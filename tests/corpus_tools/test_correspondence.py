"""Landmarks on the head: rings of edges, nearest places, rays, and what the shipped faces have."""

from pathlib import Path

import numpy as np
import pytest

from corpus_tools.shipped.head.correspondence import nearest_surface_points, read_places, write_places
from corpus_tools.shipped.head.edge_rings import EdgeRings, find_narrowest_ring
from corpus_tools.shipped.head.locate import intersect_ray, symmetrise
from lexicon.errors import DataError
from tts2face.models.face_loading import load_face
from tts2face.models.landmarks import INNER_LIP_LOWER, INNER_LIP_UPPER, N_LANDMARKS

N_AROUND, N_RINGS = 12, 5


def funnel() -> tuple[np.ndarray, np.ndarray]:
    """Vertices and quads of a funnel about the z axis, open in the middle; ring 0 is the narrowest, ring k at z = k."""
    around = np.linspace(0, 2 * np.pi, N_AROUND, endpoint=False)
    radius = np.array([2.0, 3.0, 4.0, 5.5, 7.0])
    vertices = np.stack(
        [
            np.outer(radius, np.cos(around)),
            np.outer(radius, np.sin(around)),
            np.repeat(np.arange(N_RINGS)[:, None], N_AROUND, axis=1),
        ],
        axis=-1,
    ).reshape(-1, 3)
    row, column = (grid.ravel() for grid in np.meshgrid(np.arange(N_RINGS - 1), np.arange(N_AROUND), indexing="ij"))
    a, b = row * N_AROUND + column, row * N_AROUND + (column + 1) % N_AROUND
    return vertices, np.stack([a, b, b + N_AROUND, a + N_AROUND], axis=1)


def test_the_narrowest_inner_ring_is_found() -> None:
    """The border has no four neighbours, so the first ring that runs on is ring 1."""
    vertices, quads = funnel()
    ring = find_narrowest_ring(EdgeRings(quads, vertices), vertices, np.zeros(3), 10.0)
    assert sorted(ring) == list(range(N_AROUND, 2 * N_AROUND))


def test_a_ring_stays_clear_of_a_ball() -> None:
    vertices, quads = funnel()
    ring = find_narrowest_ring(EdgeRings(quads, vertices), vertices, np.zeros(3), 10.0, clear=3.5)
    assert sorted(ring) == list(range(2 * N_AROUND, 3 * N_AROUND))


def test_a_hole_without_a_ring_is_refused() -> None:
    vertices, quads = funnel()
    with pytest.raises(DataError, match="no edge ring"):
        find_narrowest_ring(EdgeRings(quads, vertices), vertices, np.array([50.0, 0, 0]), 10.0)


def test_the_nearest_place_is_that_of_a_dense_sample() -> None:
    rng = np.random.default_rng(0)
    vertices, triangles = rng.normal(size=(6, 3)), np.array([[0, 1, 2], [3, 4, 5]])
    points = rng.normal(size=(20, 3)) * 2
    grid = np.array([(a, b) for a in np.linspace(0, 1, 201) for b in np.linspace(0, 1, 201) if a + b <= 1])
    dense = np.concatenate([(np.column_stack([1 - grid.sum(1), grid])) @ vertices[corners] for corners in triangles])
    number, weights, distance = nearest_surface_points(points, vertices, triangles)
    known = np.linalg.norm(points[:, None] - dense[None], axis=2).min(axis=1)
    assert (weights >= 0).all()
    assert weights.sum(axis=1) == pytest.approx(1, abs=1e-12)
    assert (distance <= known + 1e-12).all()
    assert distance == pytest.approx(known, abs=0.02)  # the sample's step
    there = np.einsum("pk,pkd->pd", weights, vertices[triangles[number]])
    assert np.linalg.norm(there - points, axis=1) == pytest.approx(distance, abs=1e-12)


def test_a_ray_meets_the_first_triangle_squarely() -> None:
    square = np.array([[[-1, -1, 0], [1, -1, 0], [0, 2, 0]], [[-1, -1, -3], [1, -1, -3], [0, 2, -3]]], float)
    place, facing = intersect_ray(np.array([0.1, 0.2, 5.0]), np.array([0.0, 0, -1]), square)
    assert place == pytest.approx([0.1, 0.2, 0], abs=1e-12)
    assert facing == pytest.approx(1)
    place, facing = intersect_ray(np.array([9.0, 9.0, 5.0]), np.array([0.0, 0, -1]), square)
    assert facing == 0


def test_halves_are_made_alike() -> None:
    places = np.array([[2.0, 1, 0], [-2.4, 1.2, 0], [0.1, 3, 1]])
    assert symmetrise(places, np.array([1, 0, 2])) == pytest.approx(
        np.array([[2.2, 1.1, 0], [-2.2, 1.1, 0], [0, 3, 1]])
    )


def test_a_table_round_trips_and_a_damaged_one_is_refused(tmp_path: Path) -> None:
    write_places({3: np.array([0.1, -2.0, 3.25])}, tmp_path / "table.csv")
    assert read_places(tmp_path / "table.csv")[3] == pytest.approx([0.1, -2.0, 3.25], abs=1e-6)
    (tmp_path / "table.csv").write_text("landmark,x\n1,2\n")
    with pytest.raises(DataError, match="not a table of landmark"):
        read_places(tmp_path / "table.csv")


@pytest.mark.parametrize("name", ["head", "ada"])
def test_shipped_faces_have_all_landmarks_and_lips_that_meet(name: str) -> None:
    face = load_face(name)
    assert np.array_equal(np.sort(face.landmarks), np.arange(N_LANDMARKS))
    assert face.landmark_weights.sum(axis=1) == pytest.approx(1, abs=1e-5)
    places = np.zeros((N_LANDMARKS, 3))
    places[face.landmarks] = np.einsum(
        "lk,lkd->ld", face.landmark_weights, face.vertices[face.landmark_vertices].astype(float)
    )
    gaps = places[list(INNER_LIP_UPPER), 1] - places[list(INNER_LIP_LOWER), 1]
    assert np.abs(gaps).max() < 0.3  # mm: a hair's breadth, hidden where lips press
    eyes = [places[index] for index in (468, 473)]
    for middle, eye in zip(eyes, sorted(face.eyes, key=lambda eye: float(eye.centre[0])), strict=True):
        assert middle[:2] == pytest.approx(eye.centre[:2], abs=1.0)
