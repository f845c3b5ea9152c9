"""Landmark alignment, against known transforms."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.face.posing import posed_vertices
from tts2face.face.landmarks import (
    axis_scales,
    landmark_motion,
    landmark_positions,
    procrustes_rotation,
    scatter_landmarks,
)
from tts2face.models.face_loading import load_face


@pytest.mark.parametrize("seed", range(5))
def test_a_known_rotation_is_recovered(seed: int) -> None:
    generator = np.random.default_rng(seed)
    places = generator.normal(0, 40, (60, 3))
    turn = Rotation.random(random_state=seed).as_matrix()
    assert procrustes_rotation(places, 1.7 * places @ turn.T + [3, -5, 8]) == pytest.approx(turn, abs=1e-8)


def test_known_scales_are_recovered_and_clipped() -> None:
    places = np.random.default_rng(1).normal(0, 40, (60, 3))
    assert axis_scales(places, places * [1.2, 0.8, 1.0] + 7, (0.1, 9)) == pytest.approx([1.2, 0.8, 1.0])
    assert axis_scales(places, places * [1.2, 0.8, 1.0] + 7, (0.9, 1.1)) == pytest.approx([1.1, 0.9, 1.0])


def test_landmarks_move_like_those_of_the_posed_face() -> None:
    face = load_face("head")
    number = face.shape_names.index("mouthSmileLeft")
    weights = np.zeros(len(face.shape_names))
    weights[number] = 0.7
    posed = (posed_vertices(face, weights)[face.landmark_vertices] * face.landmark_weights[..., None]).sum(axis=1)
    moved = landmark_positions(face) + 0.7 * landmark_motion(face, np.array([number]))[..., 0]
    assert moved == pytest.approx(posed, abs=1e-4)
    assert np.isnan(scatter_landmarks(face, moved)).sum() == 3 * (478 - len(face.landmarks))
