"""Cuts of meshes along a plane."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.interchange.characters.made import shipped_head, write_character_file
from tts2face.interchange.characters.cutting import cut_triangles
from tts2face.interchange.characters.gltf_reader import read_gltf_character
from tts2face.interchange.characters.head_mesh import BUST_SHARE, WIDTH_SHARE, build_head_mesh, moved_box
from tts2face.interchange.characters.importing import propose_mapping

ROUNDING = 1e-9  # of coordinates of about 1


def area_vectors(places: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    a, b, c = (places[triangles[:, corner]] for corner in range(3))
    return np.cross(b - a, c - a) / 2


def cut_places(places: np.ndarray, triangles: np.ndarray, heights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    cut = cut_triangles(triangles, heights)
    there = places[cut.upper] + cut.share[:, None] * (places[cut.lower] - places[cut.upper])
    return np.concatenate([places, there]), cut.triangles


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=60, deadline=None)
def test_both_sides_of_a_cut_make_up_the_mesh(seed: int) -> None:
    random = np.random.default_rng(seed)
    places, triangles = random.normal(size=(12, 3)), random.integers(0, 12, (20, 3))
    triangles = triangles[[len(set(row)) == 3 for row in triangles.tolist()]]
    heights = places[:, 1] - 0.2
    sides = [cut_places(places, triangles, side * heights) for side in (1, -1)]
    total = sum(area_vectors(*side).sum(axis=0) for side in sides)
    np.testing.assert_allclose(total, area_vectors(places, triangles).sum(axis=0), atol=ROUNDING)
    sizes = sum(np.linalg.norm(area_vectors(*side), axis=1).sum() for side in sides)
    assert abs(sizes - np.linalg.norm(area_vectors(places, triangles), axis=1).sum()) < ROUNDING
    for side, (there, kept) in zip((1, -1), sides, strict=True):
        assert (side * (there[kept, 1] - 0.2)).min(initial=0.0) > -ROUNDING


def test_two_triangles_share_the_points_of_their_common_edge() -> None:
    cut = cut_triangles(np.array([[0, 1, 2], [2, 1, 3]]), np.array([1.0, -1.0, 1.0, -3.0]))
    assert sorted(zip(cut.upper.tolist(), cut.lower.tolist(), strict=True)) == [(0, 1), (2, 1), (2, 3)]
    assert cut.share.tolist() == [0.5, 0.5, 0.25]
    assert cut.source.tolist() == [1, 0, 0]


def test_a_body_is_cut_straight_below_the_neck(tmp_path: Path) -> None:
    head = shipped_head()
    long = np.array(head.vertices)
    neck = long[:, 1] < np.median(long[:, 1]) - 60.0
    long[neck, 1] -= 8 * (np.median(long[:, 1]) - 60.0 - long[neck, 1])  # stretched to a body
    character = read_gltf_character(write_character_file(tmp_path / "body.glb", face=replace(head, vertices=long)))
    mesh = build_head_mesh(character, propose_mapping(character), 0.0)
    low, _ = moved_box(mesh)
    height = mesh.vertices[:, 1].max() - low[1]
    lowest = low[1] - BUST_SHARE * height
    assert abs(mesh.vertices[:, 1].min() - lowest) < 1e-6  # metres; single precision in the file
    edges = np.sort(mesh.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    unique, uses = np.unique(edges, axis=0, return_counts=True)
    border = unique[uses == 1]
    near = mesh.vertices[border][:, :, 1].max(axis=1) < lowest + 0.01
    on_plane = np.abs(mesh.vertices[border[near]][:, :, 1] - lowest).max(axis=1) < 1e-6
    assert near.sum() > 30
    assert on_plane.mean() > 0.9  # others are borders of hair and seams of the texture
    assert np.abs(mesh.vertices[:, 0]).max() <= WIDTH_SHARE * height + 1e-3


def test_attributes_of_cut_edges_are_interpolated(tmp_path: Path) -> None:
    character = read_gltf_character(write_character_file(tmp_path / "head.glb"))
    mesh = build_head_mesh(character, propose_mapping(character), 0.0)
    plane = np.array([0.3, 1.0, 0.1])
    linear = mesh.vertices @ np.array([[1.0, 2.0], [0.5, -1.0], [3.0, 0.2]])
    known = replace(mesh, uv=linear, shapes={"jawOpen": mesh.vertices.astype(np.float32)})
    cut = known.cut(known.vertices @ plane)
    assert (cut.vertices @ plane).min() > -ROUNDING
    np.testing.assert_allclose(cut.uv, cut.vertices @ np.array([[1.0, 2.0], [0.5, -1.0], [3.0, 0.2]]), atol=ROUNDING)
    np.testing.assert_allclose(cut.shapes["jawOpen"], cut.vertices, atol=1e-6)
    assert cut.shapes["jawOpen"].dtype == np.float32
