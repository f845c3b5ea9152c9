"""Fit of baked light: how vertices answer to the terms of a pose or to pictures, partners, and modes of turns."""

from dataclasses import replace

import numpy as np
import pytest

from corpus_tools.shipped.film.fit_light import HIDDEN_WEIGHT, RIDGE
from corpus_tools.shipped.film.fit_pictures import SIDE_PX, fit_to_pictures
from corpus_tools.shipped.film.fit_responses import find_partners, fit_responses, limits_of
from corpus_tools.shipped.film.poses import LitPose
from corpus_tools.shipped.film.texel_light import principal_modes
from tests.picture.film.lit_face import lit_tiny_face
from tts2face.models.baked_light import LIMIT_STEP, quantised
from tts2face.models.face import Face
from tts2face.models.face_loading import load_face
from tts2face.models.light import Baked
from tts2face.picture.options import Picture
from tts2face.picture.renderer import mesh_renderer

N_POSES, N_TERMS, N_VERTICES = 30, 5, 50


@pytest.fixture(scope="module")
def truth() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Terms (P, T, N), responses (T, 3, N), and the changes (P, N, 3) that follow from them."""
    rng = np.random.default_rng(4)
    terms = rng.uniform(-1, 1, (N_POSES, N_TERMS, N_VERTICES))
    responses = rng.normal(0, 20, (N_TERMS, 3, N_VERTICES))
    return terms, responses, np.einsum("ptn,tcn->pnc", terms, responses)


def test_responses_are_found_from_the_poses(truth: tuple[np.ndarray, np.ndarray, np.ndarray]) -> None:
    terms, responses, changes = truth
    found = fit_responses(terms, changes, np.ones(changes.shape[:2]), RIDGE)
    assert found == pytest.approx(responses, abs=0.1)
    steps, sizes = quantised(found)
    assert steps.dtype == np.int8
    assert steps * sizes[:, None, None] == pytest.approx(found, abs=float(sizes.max()))
    cut, smaller = quantised(found, 90.0)
    assert (smaller < sizes).all()
    assert np.abs(cut).max() == 127


def test_a_pose_that_hides_a_vertex_counts_little(truth: tuple[np.ndarray, np.ndarray, np.ndarray]) -> None:
    terms, responses, changes = truth
    hidden = np.random.default_rng(5).uniform(size=changes.shape[:2]) < 0.15
    dark = np.where(hidden[..., None], -200.0, changes)
    errors = [
        np.abs(fit_responses(terms, dark, weights, RIDGE) - responses).mean()
        for weights in (np.ones(hidden.shape), ~hidden + HIDDEN_WEIGHT)
    ]
    assert errors[1] < 0.15 * errors[0]
    limits = limits_of(dark, ~hidden) * LIMIT_STEP
    shown = np.where(hidden[..., None], 0.0, changes)
    ends = np.clip([shown.min(axis=0).T, shown.max(axis=0).T], -254, 254)
    assert limits == pytest.approx(ends, abs=LIMIT_STEP / 2)


def test_a_vertex_that_few_poses_show_answers_as_its_group(truth: tuple[np.ndarray, np.ndarray, np.ndarray]) -> None:
    terms, responses, _ = truth
    alike = responses[:, :, :1] + 0.1 * (responses - responses[:, :, :1])
    changes = np.einsum("ptn,tcn->pnc", terms, alike)
    shown = np.ones(changes.shape[:2])
    shown[2:, 0] = 0.0  # two poses cannot tell five responses
    groups = np.full(N_VERTICES, "teeth")
    alone, among = (fit_responses(terms, changes, shown, 0.1, groups=one) for one in (None, groups))
    errors = [np.abs(one[:, :, 0] - alike[:, :, 0]).mean() for one in (alone, among)]
    assert errors[1] < 0.5 * errors[0]


@pytest.fixture(scope="module")
def face() -> Face:
    """The drawn woman."""
    return load_face("ada")


def test_partners_lie_across_the_lips_and_lids(face: Face) -> None:
    part = next(one for one in face.parts if one.name == "skin")
    skin = np.unique(face.triangles[part.first : part.first + part.count])
    ball = np.arange(face.eyes[0].first, face.eyes[0].first + face.eyes[0].count)
    rows = np.concatenate([skin, ball]).astype(np.int32)
    partners = find_partners(face, rows, skin, ball)
    jaw = np.abs(face.shapes[face.shape_names.index("jawOpen")][:, 1])
    numbers = {int(number): row for row, number in enumerate(face.landmarks)}
    for number in (13, 14):
        lip = int(face.landmark_vertices[numbers[number]][face.landmark_weights[numbers[number]].argmax()])
        across = int(partners[np.searchsorted(skin, lip)])
        assert across != lip
        assert (jaw[across] > 0.5 * jaw.max()) == (number == 13)
        assert np.linalg.norm(face.vertices[across] - face.vertices[lip]) < 6
    alone = rows[: len(skin)] == partners[: len(skin)]
    brow = face.vertices[skin, 1] > face.eyes[0].centre[1] + 40
    assert alone[brow].all()
    lids = partners[len(skin) :]
    assert np.isin(lids, skin).all()
    assert (face.vertices[lids, 1].mean()) > face.eyes[0].centre[1]


def test_modes_of_turns_are_orthonormal() -> None:
    changes = np.random.default_rng(6).normal(0, 5, (8, 3, 40))
    modes, weights = principal_modes(changes, 8)
    assert modes.reshape(8, -1) @ modes.reshape(8, -1).T == pytest.approx(np.eye(8), abs=1e-9)
    assert np.einsum("pc,cxn->pxn", weights, modes) == pytest.approx(changes, abs=1e-9)
    few, of_few = principal_modes(changes, 2)
    assert len(few) == of_few.shape[1] == 2


def test_what_pictures_show_corrects_the_light() -> None:
    face = lit_tiny_face()
    still = np.zeros(6, np.float32)
    weights = [np.zeros(len(face.shape_names), np.float32), np.full(len(face.shape_names), 0.4, np.float32)]
    poses = [LitPose(str(number), one, still) for number, one in enumerate(weights)]
    picture = Picture(size=f"{SIDE_PX}x{SIDE_PX}", background="transparent")
    before = [mesh_renderer(face, picture).draw(pose.weights, pose.head) for pose in poses]
    wanted = {pose.name: np.array(one) for pose, one in zip(poses, before, strict=True)}
    for one in wanted.values():
        one[..., 0] -= np.where(one[..., 3] > 0, 20, 0).astype(np.uint8)
    fitted = replace(face, light=Baked(fit_to_pictures(face, poses, wanted)))
    for pose, old in zip(poses, before, strict=True):
        new = mesh_renderer(fitted, picture).draw(pose.weights, pose.head).astype(np.float64)
        off, apart = (np.abs(one - wanted[pose.name])[old[..., 3] == 255] for one in (new, old.astype(np.float64)))
        assert off[:, 0].mean() < 0.5 * apart[:, 0].mean()
        assert off[:, 1:].mean() < 1
