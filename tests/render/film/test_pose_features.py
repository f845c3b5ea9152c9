"""What baked light depends on."""

import numpy as np
import pytest

from tts2face.face.deformation import build_rig
from tts2face.models.baked_light import PRODUCTS
from tts2face.models.face_loading import load_face
from tts2face.render.film.pose_features import (
    Features,
    Opening,
    camera_weights,
    opening_weights,
    turn_weights,
    yaw_and_pitch_deg,
)

TURNS_DEG = np.array([[-20, 0], [20, 0], [0, -12], [0, 12]])


def test_features_are_the_weights_and_products_of_both_sides() -> None:
    names = ("jawOpen", "mouthFunnel", "mouthSmileLeft", "mouthSmileRight", "eyeBlinkLeft")
    features = Features.of_shapes(names)
    assert features.of(np.zeros(5, np.float32)) == pytest.approx(0)
    found = features.of(np.array([0.5, 0.4, 1.0, 0.0, 0.8], np.float32))
    assert found[:5] == pytest.approx([0.5, 0.4, 1.0, 0.0, 0.8])
    of_products = dict(zip(PRODUCTS, found[5:], strict=True))
    assert of_products["jawOpen", "jawOpen"] == pytest.approx(0.25)
    assert of_products["mouthSmile", "jawOpen"] == pytest.approx(0.25)  # mean of both sides
    assert of_products["eyeBlinkLeft", "eyeBlinkLeft"] == pytest.approx(0.64)
    assert of_products["eyeBlinkRight", "eyeBlinkRight"] == 0  # which the face lacks


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


def test_an_opening_is_measured_in_the_head() -> None:
    face = load_face("head", hair="bald")
    rig, opening = build_rig(face), Opening.of_face(face)
    weights = np.zeros(len(face.shape_names), np.float32)
    turned = np.radians([5, 20, 3, 0, 0, 0]).astype(np.float32)
    assert opening.measures(face.vertices, np.zeros(6)) == pytest.approx(0, abs=1e-6)
    assert opening.measures(rig.pose(weights, turned), turned) == pytest.approx(0, abs=0.02)
    weights[face.shape_names.index("jawOpen")] = 0.5
    opened = opening.measures(rig.pose(weights, turned), turned)
    assert opened[0] > 1.5  # in units of 4 mm
    assert opened[2] < -0.5  # the lower lip goes down
    baked = np.stack([np.zeros(5), opened, -opened])
    shares = opening_weights(baked, opened)
    assert shares.sum() == pytest.approx(1)
    assert shares[1] > 0.99
