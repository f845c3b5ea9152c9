"""Interpolation of baked light between turns of the head and between cameras."""

import numpy as np
import pytest

from tts2face.picture.baked.interpolation import camera_weights, turn_weights, yaw_and_pitch_deg

TURNS_DEG = np.array([[-20, 0], [20, 0], [0, -12], [0, 12]])


def test_turns_have_their_own_light_and_share_it_in_between() -> None:
    turns = turn_weights(TURNS_DEG)
    assert turns.at([0, 0]) == pytest.approx(0, abs=1e-6)
    for number, turn in enumerate(TURNS_DEG):
        assert turns.at(turn) == pytest.approx(np.eye(4)[number], abs=1e-5)
    half = turns.at([10, 0])
    assert 0.3 < half[1] < 0.7
    assert turns.at([80, 0]) == pytest.approx(turns.at([23, 0]))  # light stays beyond what was baked
    assert yaw_and_pitch_deg(np.radians([3, 7, 1, 0, 0, 0])) == pytest.approx([7, 3])
    cameras = camera_weights(np.array([-35, 35]))
    assert cameras.at([35]) == pytest.approx([0, 1], abs=1e-5)
    assert cameras.at([90]) == pytest.approx([0, 1], abs=1e-5)
    assert len(camera_weights(np.zeros(0)).at([20])) == 0
