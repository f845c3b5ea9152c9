"""Head pose against poses that were put in, and against SciPy's alignment."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from lexicon.errors import DataError, InputError
from tts2face.face.deformation import head_rotation
from tts2face.models.landmarks import CHIN, MOUTH_REGION, N_LANDMARKS
from tts2face.video.pose import PIVOT, head_angles, remove_pose, rigid_points, similarity_transforms

FPS = 25.0
PX_PER_MM = 1.3
angles = st.floats(-0.6, 0.6)


def _face(n_frames: int, seed: int = 0) -> np.ndarray:
    """(T, 478, 3) faces in mm whose rigid points are fixed while all others move."""
    indices, canonical, _ = rigid_points()
    generator = np.random.default_rng(seed)
    faces = np.repeat(generator.normal(0, 40, (1, N_LANDMARKS, 3)), n_frames, axis=0)
    faces += generator.normal(0, 3, faces.shape)
    faces[:, indices] = canonical
    return faces


def _filmed(faces: np.ndarray, rotations: np.ndarray, shifts_px: np.ndarray) -> np.ndarray:
    turned = np.einsum("tij,tnj->tni", rotations, faces) * PX_PER_MM
    return turned * (1, -1, -1) + shifts_px[:, None]


def test_a_known_pose_is_found_and_taken_out():
    faces = _face(40)
    t = np.linspace(0, 2 * np.pi, 40)
    wanted = np.column_stack([0.2 * np.sin(t), 0.4 * np.cos(t), 0.1 * np.sin(2 * t)])
    rotations = np.array([head_rotation(*row) for row in wanted])
    shifts = np.column_stack([100 + 30 * np.sin(t), 120 + 10 * t, np.zeros(40)])
    posed = remove_pose(_filmed(faces, rotations, shifts), FPS)
    np.testing.assert_allclose(posed.landmarks, faces, atol=1e-4)  # mm; float32
    np.testing.assert_allclose(head_angles(posed.rotations), wanted, atol=1e-9)
    pivots = np.einsum("tij,j->ti", rotations, PIVOT) + shifts / PX_PER_MM * (1, -1, 1)
    np.testing.assert_allclose(posed.translations[:, :2], pivots[:, :2], atol=1e-9)
    np.testing.assert_allclose(posed.translations[:, 2], 0, atol=1e-9)


def test_a_jaw_that_opens_moves_neither_head_nor_upper_face():
    faces = np.repeat(_face(1), 60, axis=0)
    mouth = np.setdiff1d(MOUTH_REGION, rigid_points()[0])
    faces[:, mouth, 1] -= 15 * np.sin(np.linspace(0, 9, 60))[:, None] ** 2
    posed = remove_pose(_filmed(faces, np.repeat(np.eye(3)[None], 60, 0), np.zeros((60, 3))), FPS)
    np.testing.assert_allclose(posed.landmarks, faces, atol=1e-4)
    assert CHIN in mouth


def test_coming_nearer_is_a_shift_and_not_a_shape():
    faces = np.repeat(_face(1), 100, axis=0)
    size = np.exp(np.linspace(-0.1, 0.1, 100))[:, None, None]  # 10 % in 2 s, either side
    posed = remove_pose(_filmed(faces, np.repeat(np.eye(3)[None], 100, 0), np.zeros((100, 3))) * size, FPS)
    middle = slice(40, 60)  # far from the ends, where smoothing holds the last value
    np.testing.assert_allclose(posed.landmarks[middle], faces[middle], atol=0.5)
    assert (np.diff(posed.translations[:, 2]) > 0).all()


@given(st.integers(0, 1000))
def test_rotation_equals_scipys(seed):
    generator = np.random.default_rng(seed)
    source, target = generator.normal(size=(1, 8, 3)), generator.normal(size=(8, 3))
    weights = generator.uniform(0.1, 1, 8)
    weights /= weights.sum()
    rotation, scale = similarity_transforms(source, target, weights)
    expected, _ = Rotation.align_vectors(target - weights @ target, source[0] - weights @ source[0], weights=weights)
    np.testing.assert_allclose(rotation[0], expected.as_matrix(), atol=1e-6)
    moved = (source[0] - weights @ source[0]) @ rotation[0].T
    by_regression = (weights[:, None] * moved * (target - weights @ target)).sum() / (weights[:, None] * moved**2).sum()
    assert scale[0] == pytest.approx(by_regression, rel=1e-9)


@given(angles, angles, angles)
def test_angles_are_those_of_the_face_that_is_turned(pitch, yaw, roll):
    found = head_angles(head_rotation(pitch, yaw, roll)[None])
    np.testing.assert_allclose(found, [[pitch, yaw, roll]], atol=1e-9)


def test_frames_without_a_face_stay_empty():
    faces = _face(5)
    points = _filmed(faces, np.repeat(np.eye(3)[None], 5, 0), np.zeros((5, 3)))
    points[2] = np.nan
    posed = remove_pose(points, FPS)
    assert np.isnan(posed.landmarks[2]).all()
    np.testing.assert_allclose(posed.landmarks[[0, 1, 3, 4]], faces[[0, 1, 3, 4]], atol=1e-4)


def test_no_face_at_all():
    with pytest.raises(DataError, match="no frame shows a face"):
        remove_pose(np.full((3, N_LANDMARKS, 3), np.nan), FPS)


def test_points_of_another_mesh():
    with pytest.raises(InputError, match="of shape"):
        remove_pose(np.zeros((3, 68, 3)), FPS)
