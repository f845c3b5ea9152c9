"""Retargeting from a talker to a face."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import lsq_linear

from lexicon.errors import DataError
from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.lips.retargeting import build_retargeter, contact_gaps, inner_product_map
from tts2face.models.face import Face, FacePart
from tts2face.models.landmarks import (
    INNER_LIP_LOWER,
    INNER_LIP_UPPER,
    LOWER_LIP_INNER_MID,
    MOUTH_CORNER_LEFT,
    MOUTH_CORNER_RIGHT,
    MOUTH_REGION,
    N_LANDMARKS,
    UPPER_LIP_INNER_MID,
)
from tts2face.models.talker import ShapeModel, Talker, Utterance, speech_channels
from tts2face.numeric.least_squares import bounded_least_squares
from tts2face.types import Trajectory

N_MODES = 3
SCALE = 1.5


def rest_shape() -> np.ndarray:
    """Landmarks on a curved surface, the mouth 50 mm wide, facing inner lips 0.4 mm apart."""
    rng = np.random.default_rng(1)
    shape = rng.uniform(-60, 60, (N_LANDMARKS, 3))
    shape[:, 2] = 50 - 0.01 * (shape[:, 0] ** 2 + shape[:, 1] ** 2)
    shape[MOUTH_CORNER_RIGHT], shape[MOUTH_CORNER_LEFT] = (-25, -40, 20), (25, -40, 20)
    for at, (upper, lower) in enumerate(zip(INNER_LIP_UPPER, INNER_LIP_LOWER, strict=True)):
        x = -20 + 4 * at
        shape[upper], shape[lower] = (x, -39.8, 30), (x, -40.2, 30)
    return shape


def talker_of(seed: int = 0, opening: float = 8.0) -> Talker:
    """Orthonormal modes; the first opens the inner lips; one recorded /p/ with the lips at rest."""
    rng = np.random.default_rng(seed)
    modes = rng.normal(size=(N_MODES, N_LANDMARKS, 3))
    modes[:, [*INNER_LIP_UPPER, *INNER_LIP_LOWER]] = 0
    modes[0] = 0
    modes[0, INNER_LIP_LOWER, 1] = -1
    flat = np.linalg.qr(modes.reshape(N_MODES, -1).T)[0].T
    flat *= np.sign((flat * modes.reshape(N_MODES, -1)).sum(axis=1, keepdims=True))
    model = ShapeModel(
        rest_shape().astype(np.float32),
        flat.reshape(N_MODES, N_LANDMARKS, 3).astype(np.float32),
        np.ones(N_MODES, np.float32),
        N_MODES,
        np.zeros(N_MODES, np.float32),
    )
    frames = np.zeros((30, N_MODES), np.float32)
    frames[20:, 0] = opening
    phones = PhoneSequence([SILENCE, "p", "ɑ"], [0.0, 0.4, 0.6, 1.2])
    taken = Utterance("one", phones, (), frames, np.zeros((30, 6), np.float32), np.zeros(30, np.float32))
    return Talker(25.0, model, (taken,), {})


def face_of(shapes: np.ndarray, limits: tuple[float, float] = (-100.0, 100.0)) -> Face:
    """A face whose vertices are the talker's landmarks, `SCALE` times as large, with the shapes (K, L, 3)."""
    vertices = (rest_shape() * SCALE).astype(np.float32)
    n = len(shapes)
    here = np.repeat(np.arange(N_LANDMARKS, dtype=np.int32)[:, None], 3, axis=1)
    return Face(
        vertices=vertices,
        triangles=np.array([[0, 1, 2]], np.int32),
        parts=(FacePart("skin", 0, 1),),
        shape_names=tuple(f"mouth{i}" for i in range(n)),
        shapes=shapes.astype(np.float32),
        limits=np.tile(np.array(limits, np.float32), (n, 1)),
        eyes=(),
        colours=np.zeros((N_LANDMARKS, 3), np.uint8),
        uv=None,
        textures=(),
        landmarks=np.arange(N_LANDMARKS, dtype=np.int32),
        landmark_vertices=here,
        landmark_weights=np.tile(np.array([1, 0, 0], np.float32), (N_LANDMARKS, 1)),
        pivot=np.zeros(3, np.float32),
    )


def motion_of(talker: Talker, n_frames: int = 12, seed: int = 3) -> Trajectory:
    values = np.random.default_rng(seed).normal(size=(n_frames, N_MODES)) * 4
    return Trajectory(speech_channels(talker.model), values, 25.0)


@settings(deadline=None)  # the first example compiles
@given(st.integers(0, 10_000))
def test_agrees_with_scipy_within_limits(seed: int) -> None:
    rng = np.random.default_rng(seed)
    design, wanted = rng.normal(size=(20, 6)), rng.normal(size=(4, 20)) * 2
    limits = np.stack([-rng.uniform(0, 1, 6), rng.uniform(0, 1, 6)], axis=1)
    solved = bounded_least_squares(design.T @ design, wanted @ design, limits)
    for frame, target in zip(solved, wanted, strict=True):
        known = lsq_linear(design, target, (limits[:, 0], limits[:, 1]), tol=1e-12, method="bvls")  # exact
        assert frame == pytest.approx(known.x, abs=1e-8)


@settings(deadline=None)
@given(st.integers(0, 10_000))
def test_inner_products_are_the_orthonormal_case_of_least_squares(seed: int) -> None:
    """T07 eq. 5; flipping a source vector flips its column only, so that sign flips cancel out."""
    rng = np.random.default_rng(seed)
    source = np.linalg.qr(rng.normal(size=(30, 4)))[0].T
    target = np.linalg.qr(rng.normal(size=(30, 7)))[0].T
    parameters = rng.normal(size=(5, 4))
    mapped = parameters @ inner_product_map(source, target).T
    solved = bounded_least_squares(target @ target.T, parameters @ source @ target.T, np.tile([-1e9, 1e9], (7, 1)))
    assert mapped == pytest.approx(solved, abs=1e-9)
    flipped = inner_product_map(source * np.array([[-1], [1], [1], [1]]), target)
    assert flipped * np.array([-1, 1, 1, 1]) == pytest.approx(inner_product_map(source, target), abs=1e-12)


def test_a_face_with_the_modes_of_the_talker_moves_like_the_talker() -> None:
    talker = talker_of()
    face = face_of(talker.model.basis * SCALE)
    motion = motion_of(talker)
    weights = build_retargeter(talker, face).retarget(motion).values
    elsewhere = [landmark for landmark in MOUTH_REGION if landmark not in INNER_LIP_LOWER]  # contact changes those
    moved = np.tensordot(weights, face.shapes, axes=1)[:, elsewhere]
    wanted = np.tensordot(motion.values, talker.model.basis * SCALE, axes=1)[:, elsewhere]
    assert np.abs(moved - wanted).max() < 0.05 * np.abs(wanted).max()


def test_rest_stays_at_rest() -> None:
    talker = talker_of()
    face = face_of(talker.model.basis)
    still = Trajectory(speech_channels(talker.model), np.zeros((4, N_MODES)), 25.0)
    moved = np.tensordot(build_retargeter(talker, face).retarget(still).values, face.shapes, axes=1)
    assert np.abs(moved[:, np.setdiff1d(np.arange(N_LANDMARKS), INNER_LIP_LOWER)]).max() < 0.05


def test_lips_that_touch_on_the_talker_touch_on_the_face() -> None:
    """At rest the tracked lips of the talker are 0.4 mm apart: that is contact, and the face's lips stay closed."""
    talker = talker_of()
    assert contact_gaps(talker)[1:-1] == pytest.approx(0.4, abs=0.01)
    face = face_of(talker.model.basis)
    closed = Trajectory(speech_channels(talker.model), np.zeros((1, N_MODES)), 25.0)
    moved = np.tensordot(build_retargeter(talker, face).retarget(closed).values[0], face.shapes, axes=1)
    assert abs(moved[UPPER_LIP_INNER_MID, 1] - moved[LOWER_LIP_INNER_MID, 1]) < 0.1


def test_known_weights_are_recovered() -> None:
    """Landmarks of known shape weights, for a talker whose modes are the shapes."""
    talker = talker_of()
    shapes = talker.model.basis * SCALE
    turned = np.linalg.qr(np.random.default_rng(2).normal(size=(N_MODES, N_MODES)))[0]
    face = face_of(np.tensordot(turned, shapes, axes=1))
    motion = Trajectory(speech_channels(talker.model), [[12.0, 1.0, -2.0], [20.0, -1.0, 0.5]], 25.0)  # open lips
    weights = build_retargeter(talker, face).retarget(motion).values
    closed = np.array([0.4 * np.sqrt(len(INNER_LIP_UPPER)), 0, 0])  # gaps of the face begin at contact
    assert weights == pytest.approx((motion.values + closed) @ turned.T, rel=0.01, abs=0.1)


def test_no_motion_gives_no_weights() -> None:
    talker = talker_of()
    still = Trajectory(speech_channels(talker.model), np.tile(talker.model.rest, (3, 1)), 25.0)
    assert np.abs(build_retargeter(talker, face_of(talker.model.basis)).retarget(still).values).max() < 1e-6


def test_linearly_dependent_shapes_are_refused() -> None:
    with pytest.raises(DataError, match="linearly dependent"):
        bounded_least_squares(np.ones((2, 2)) - 2 * np.eye(2), np.ones((1, 2)), np.array([[0.0, 1.0], [0.0, 1.0]]))


def test_limits_hold_and_frames_are_independent() -> None:
    talker = talker_of()
    ready = build_retargeter(talker, face_of(talker.model.basis, (-0.5, 2.0)))
    motion = motion_of(talker)
    weights = ready.retarget(motion).values
    assert weights.min() >= -0.5
    assert weights.max() <= 2.0
    order = np.random.default_rng(5).permutation(len(motion))
    shuffled = ready.retarget(Trajectory(motion.channels, motion.values[order], motion.fps)).values
    assert np.array_equal(shuffled, weights[order])


def test_a_face_without_lips_is_refused() -> None:
    talker = talker_of()
    whole = face_of(talker.model.basis)
    kept = np.setdiff1d(np.arange(N_LANDMARKS), [UPPER_LIP_INNER_MID])
    lipless = replace(
        whole,
        landmarks=whole.landmarks[kept],
        landmark_vertices=whole.landmark_vertices[kept],
        landmark_weights=whole.landmark_weights[kept],
    )
    with pytest.raises(DataError, match="lacks landmark 13 of the lips"):
        build_retargeter(talker, lipless)
    still = replace(whole, shape_names=tuple(f"brow{i}" for i in range(N_MODES)))
    with pytest.raises(DataError, match="shapes named jaw"):
        build_retargeter(talker, still)
