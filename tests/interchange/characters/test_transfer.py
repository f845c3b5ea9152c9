"""Shapes carried over to heads without any: made of the shipped head, whose own shapes are the known answer."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from lexicon.errors import DataError, InputError
from tests.interchange.characters.made import Variant, head_without_mouth, shipped_head, write_character_file
from tts2face.face.eyelids import build_eyelid_model
from tts2face.interchange.characters.importing import import_face
from tts2face.interchange.characters.transfer.mouth_cut import is_closed
from tts2face.interchange.characters.transfer.parts import jaw_shares
from tts2face.interchange.characters.transfer.registration import fit_similarity, nearest_on_triangles
from tts2face.interchange.characters.transfer.sight import look
from tts2face.interchange.characters.transfer.skin import build_skin
from tts2face.interchange.characters.transfer.source import DRAWN, REALISTIC, choose_source, eye_height, own_landmarks
from tts2face.models.face import Face
from tts2face.models.face_loading import load_face


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
    sight = look(places, triangles, (np.zeros(3), np.full(3, 4.0)), 0.5)
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
    bare = write_character_file(tmp_path / "bare.glb", face=_shapeless())
    with pytest.raises(DataError, match="carry over those of a shipped head with --shapes transfer"):
        import_face(bare)


@cache
def _shapeless() -> Face:
    head = head_without_mouth()
    return replace(head, shape_names=(), shapes=head.shapes[:0], limits=head.limits[:0], eyes=_still(head))


def _still(head: Face) -> tuple:
    return tuple(replace(eye, turns={}) for eye in head.eyes)


@pytest.mark.build
@pytest.mark.usefixtures("face_model")
def test_the_shapes_of_a_head_come_back(tmp_path: Path) -> None:
    """The shipped head without its shapes, turned aside: its own are carried over to it."""
    path = write_character_file(tmp_path / "bare.glb", Variant(turn_deg=22.0), face=_shapeless())
    steps: list[tuple[int, int]] = []
    imported = import_face(path, shapes="transfer", on_progress=lambda done, of: steps.append((done, of)))
    face, head = imported.face, head_without_mouth()
    assert face.metadata["shapes_from"] == "head"
    assert "character" not in face.metadata
    assert len(face.eyes) == 2
    assert steps[-1][0] == len(steps) <= steps[-1][1]
    jaw = face.shapes[face.shape_names.index("jawOpen")]
    assert np.abs(jaw).max() == pytest.approx(np.abs(head.shapes[head.shape_names.index("jawOpen")]).max(), rel=0.1)
