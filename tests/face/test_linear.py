"""Deformation of a face: the compiled rig against the formula, rotations against scipy's, and the neck."""

import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.face.posing import posed_vertices
from tests.picture.tiny_face import tiny_face
from tts2face.face.deformation import build_rig, head_rotation, rotation_matrix
from tts2face.models.landmarks import CHIN

WEIGHTS = np.array([0.4, -0.3, 1.0, 0.6])


def test_the_rig_poses_as_the_plain_formula_does():
    face = tiny_face()
    np.testing.assert_allclose(build_rig(face).pose(WEIGHTS), posed_vertices(face, WEIGHTS), atol=1e-4)


def test_rest_is_rest():
    face = tiny_face()
    np.testing.assert_allclose(build_rig(face).pose(np.zeros(4)), face.vertices, atol=1e-5)


@pytest.mark.parametrize("turn", [(0, 0, 0), (0.3, 0, 0), (0, -1.2, 0.4), (2, 1, -0.5)])
def test_rotation_vectors_turn_as_scipy_turns(turn):
    np.testing.assert_allclose(rotation_matrix(np.array(turn)), Rotation.from_rotvec(turn).as_matrix(), atol=1e-12)


def test_a_head_pose_nods_down_turns_left_and_tilts():
    nose, left, up = np.eye(3)[[2, 0, 1]]
    assert (head_rotation(0.2, 0, 0) @ nose)[1] < 0  # nod down
    assert (head_rotation(0, 0.2, 0) @ nose)[0] > 0  # turn to the own left
    assert (head_rotation(0, 0, 0.2) @ left)[1] > 0  # tilt about the axis out of the face
    both = Rotation.from_euler("zxy", [0.3, 0.1, 0.2]).as_matrix()
    np.testing.assert_allclose(head_rotation(0.1, 0.2, 0.3), both, atol=1e-12)
    assert up @ both @ up < 1


def test_a_face_without_neck_moves_rigidly_about_its_pivot():
    face = tiny_face()
    moved = build_rig(face).pose(np.zeros(4), np.array([0.1, 0.2, 0.3, 4.0, 5.0, 6.0]))
    turn = head_rotation(0.1, 0.2, 0.3)
    expected = (face.vertices - face.pivot) @ turn.T + face.pivot + [4.0, 5.0, 6.0]
    np.testing.assert_allclose(moved, expected, atol=1e-3)


def test_the_end_of_a_neck_stays_while_the_head_turns():
    face = tiny_face()
    chin = int(np.argmin(np.abs(face.vertices[:, 1] + 40)))
    face = dataclasses.replace(
        face,
        landmarks=np.array([CHIN], np.int32),
        landmark_vertices=np.full((1, 3), chin, np.int32),
        landmark_weights=np.array([[1, 0, 0]], np.float32),
    )
    moved = build_rig(face).pose(np.zeros(4), np.array([0, 0.3, 0, 0, 0, 0])) - face.vertices
    lowest, highest = np.argmin(face.vertices[:, 1]), np.argmax(face.vertices[:, 1])
    np.testing.assert_allclose(moved[lowest], 0, atol=1e-5)
    expected = (head_rotation(0, 0.3, 0) - np.eye(3)) @ (face.vertices[highest] - face.pivot)
    np.testing.assert_allclose(moved[highest], expected, atol=1e-3)
