"""Shapes carried over to heads without any: made of the shipped head, whose own shapes are the known answer."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from lexicon.errors import DataError, InputError
from tests.interchange.characters.made import head_without_mouth, shipped_head, write_character_file
from tts2face.face.eyelids import build_eyelid_model
from tts2face.interchange.characters.importing import import_face
from tts2face.interchange.characters.transfer.kinds import card_triangles
from tts2face.interchange.characters.transfer.mouth_cut import MOUTH, RELIEF, is_closed, lip_relief, open_mouth
from tts2face.interchange.characters.transfer.parts import jaw_shares
from tts2face.interchange.characters.transfer.registration import fit_similarity, nearest_on_triangles
from tts2face.interchange.characters.transfer.sight import view_ahead
from tts2face.interchange.characters.transfer.skin import build_skin
from tts2face.interchange.characters.transfer.source import DRAWN, REALISTIC, choose_source, eye_height, own_landmarks
from tts2face.models.face import Face, FacePart
from tts2face.models.face_loading import load_face
from tts2face.models.landmarks import (
    INNER_LIP_LOWER,
    INNER_LIP_UPPER,
    LEFT_LIDS,
    N_MESH_LANDMARKS,
    OUTER_LIP_LOWER,
    OUTER_LIP_UPPER,
    RIGHT_LIDS,
)


def test_a_similarity_is_found_again() -> None:
    rng = np.random.default_rng(3)
    points = rng.normal(size=(40, 3))
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    found = fit_similarity(points, 2.5 * points @ turn.T + [1.0, 2.0, 3.0])
    assert found.scale == pytest.approx(2.5)
    np.testing.assert_allclose(found.turn, turn, atol=1e-12)
    np.testing.assert_allclose(found.places(points[:1]), 2.5 * points[:1] @ turn.T + [1.0, 2.0, 3.0], atol=1e-12)


def test_nearest_points_of_triangles_are_those_of_dense_samples() -> None:
    rng = np.random.default_rng(5)
    corners, places = rng.normal(size=(30, 3, 3)), rng.normal(size=(30, 3))
    weights, far = nearest_on_triangles(places, corners)
    np.testing.assert_allclose(weights.sum(axis=1), 1.0)
    first, second = np.meshgrid(np.linspace(0, 1, 101), np.linspace(0, 1, 101))
    inside = first + second <= 1 + 1e-9
    mixed = np.column_stack([1 - first[inside] - second[inside], first[inside], second[inside]])
    samples = np.einsum("sk,fkd->fsd", mixed, corners)
    sampled = np.linalg.norm(samples - places[:, None], axis=2).min(axis=1)
    assert (far <= sampled + 1e-9).all()
    np.testing.assert_allclose(far, sampled, atol=0.03)  # a hundredth of an edge of about two


def test_what_is_seen_is_the_foremost() -> None:
    square = np.array([[0.0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0]])
    places = np.concatenate([square, square * [0.45, 1, 1] + [0, 0, 1.0]])
    triangles = np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]])
    sight = view_ahead(places, triangles, (np.zeros(3), np.full(3, 4.0)), 0.5)
    assert sight.depth.shape == (8, 8)
    np.testing.assert_allclose(sight.heights(np.array([True, True, False, False])), [0] * 4 + [4.0] * 4)


def test_the_source_is_of_the_kind_of_the_target() -> None:
    chosen = {name: choose_source(own_landmarks(load_face(name))) for name in ("head", "mara", "ben", "zuri")}
    assert chosen == {"head": REALISTIC, "mara": REALISTIC, "ben": DRAWN, "zuri": DRAWN}
    assert eye_height(own_landmarks(shipped_head())) < 0.16


def test_lower_teeth_follow_the_jaw_and_upper_ones_do_not() -> None:
    head = shipped_head()
    shares = jaw_shares(head, own_landmarks(head))
    for part in head.parts:
        rows = np.unique(head.triangles[part.first : part.first + part.count])
        if part.name in {"teeth_upper", "gums_upper"}:
            assert shares[rows].max() == 0.0
        elif part.name in {"teeth_lower", "gums_lower", "tongue"}:
            assert shares[rows].min() == 1.0


def test_the_shipped_head_has_open_lips() -> None:
    assert not is_closed(build_skin(shipped_head(), own_landmarks(shipped_head())))


def test_eyes_that_are_one_with_the_skin_stay_open() -> None:
    head = shipped_head()
    still = head.shapes.copy()
    still[[name.startswith(("eyeBlink", "eyeWide")) for name in head.shape_names]] = 0.0
    lids = build_eyelid_model(replace(head, shapes=still))
    weights = lids.close(np.zeros((1, len(head.shape_names))), np.ones((1, 2)))
    assert np.abs(weights).max() < 1e-6


def test_options_without_effect_are_refused(tmp_path: Path) -> None:
    (tmp_path / "map.tsv").write_text("jawOpen\tA\n")
    with pytest.raises(InputError, match="--mapping has no effect with --shapes transfer"):
        import_face(tmp_path / "a.glb", shapes="transfer", mapping=tmp_path / "map.tsv")
    with pytest.raises(InputError, match="there are no shapes 'own'; choose transfer"):
        import_face(tmp_path / "a.glb", shapes="own")


def test_a_head_without_shapes_is_offered_the_transfer(tmp_path: Path) -> None:
    bare = write_character_file(tmp_path / "bare.glb", face=shapeless_head())
    with pytest.raises(DataError, match="carry over those of a shipped head with --shapes transfer"):
        import_face(bare)


def test_lips_in_one_piece_are_cut_apart_and_a_mouth_lies_behind_them() -> None:
    face, landmarks = plate()
    skin = build_skin(face, landmarks)
    assert is_closed(skin)
    assert lip_relief(face, landmarks) < RELIEF  # a plate is a painted mouth
    opened = open_mouth(face, skin, 1.0)
    assert opened is not None
    upper, lower = (np.flatnonzero(opened.sides == side) for side in (1, 2))
    places = opened.face.vertices
    np.testing.assert_allclose(np.sort(places[upper, 0]), np.sort(places[lower, 0]))
    assert np.ptp(places[upper, 0]) > 40.0  # of a mouth of 50 mm
    assert np.abs(places[np.concatenate([upper, lower]), 1]).max() < 0.2
    corners = opened.face.triangles
    moved = places.astype(np.float64).copy()
    moved[upper, 1] += 5.0
    flat = np.cross(moved[corners[:, 1]] - moved[corners[:, 0]], moved[corners[:, 2]] - moved[corners[:, 0]])
    skin_part = opened.face.parts[0]
    assert (flat[: skin_part.first + skin_part.count, 2] > -1e-6).sum() > 0.9 * skin_part.count  # none is turned over
    assert opened.face.parts[-1].name == MOUTH
    assert (places[opened.rows.ravel(), 2] < 0).all()
    parted = build_skin(opened.face, landmarks, opened.sides)
    assert not is_closed(parted)


def test_a_card_shares_its_root_with_the_skin_and_a_patch_of_texture_its_border() -> None:
    face, landmarks = plate()
    places, corners = face.vertices.astype(np.float64), face.triangles.astype(np.int64)
    lid = landmarks[list(RIGHT_LIDS[0])]
    middles = places[corners].mean(axis=1)
    is_patch = (np.abs(middles - lid.mean(axis=0)) < [8.0, 6.0, 1.0]).all(axis=1)
    own = np.unique(corners[is_patch])
    of = np.full(len(places), -1)
    of[own] = len(places) + np.arange(len(own))
    corners[is_patch] = of[corners[is_patch]]  # divided as by a seam of the texture
    places = np.concatenate([places, places[own]])
    root = places[own[np.argsort(np.abs(places[own] - lid[4]).sum(axis=1))[0]]]
    card = root + np.array([[0.0, 0, 0], [2.5, 0, 0], [2.5, 4, 5], [0, 4, 5]])
    n = len(places)
    corners = np.concatenate([corners, n + np.array([[0, 1, 2], [0, 2, 3]])])
    is_card = card_triangles(np.concatenate([places, card]), corners, lid, 15.0)
    np.testing.assert_array_equal(np.flatnonzero(is_card), [len(corners) - 2, len(corners) - 1])
    behind = card * [1.0, 1.0, -1.0]  # as what lines a lid
    assert not card_triangles(np.concatenate([places, behind]), corners, lid, 15.0).any()


def plate(n: int = 49) -> tuple[Face, np.ndarray]:
    """A plate of 120 x 120 mm as a face, and landmarks of a mouth in its middle and of eyes above it."""
    x, y = np.meshgrid(np.linspace(-60, 60, n), np.linspace(-59, 61, n))
    places = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    at = np.arange(x.size).reshape(x.shape)
    a, b, c, d = at[:-1, :-1].ravel(), at[:-1, 1:].ravel(), at[1:, 1:].ravel(), at[1:, :-1].ravel()
    corners = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    landmarks = np.zeros((N_MESH_LANDMARKS, 3))
    lines = ((INNER_LIP_UPPER, 0, 0), (INNER_LIP_LOWER, 0, 0), (OUTER_LIP_UPPER, 0, 7), (OUTER_LIP_LOWER, 0, -7))
    lids = [(line, side * 30, 40 + high) for side, ring in ((-1, RIGHT_LIDS), (1, LEFT_LIDS))
            for line, high in zip(ring, (4, -4), strict=True)]  # fmt: skip
    for line, middle, height in (*lines, *lids):
        half = 25.0 if middle == 0 else 14.0
        landmarks[list(line), 0] = middle + np.linspace(-half, half, len(line))
        landmarks[list(line), 1] = height
    part = FacePart("skin:plate", 0, len(corners))
    empty = np.zeros((0, 3))
    return Face(
        vertices=places.astype(np.float32), triangles=corners.astype(np.int32), parts=(part,), shape_names=(),
        shapes=np.zeros((0, len(places), 3), np.float32), limits=np.zeros((0, 2), np.float32), eyes=(),
        colours=np.full((len(places), 3), 200, np.uint8), uv=None, textures=(), landmarks=np.zeros(0, np.int32),
        landmark_vertices=empty.astype(np.int32), landmark_weights=empty.astype(np.float32),
        pivot=np.zeros(3, np.float32),
    ), landmarks  # fmt: skip


@cache
def shapeless_head() -> Face:
    """Skin and eyes of the shipped head without its shapes."""
    head = head_without_mouth()
    return replace(
        head,
        shape_names=(),
        shapes=head.shapes[:0],
        limits=head.limits[:0],
        eyes=tuple(replace(eye, turns={}) for eye in head.eyes),
    )
