"""Appearance regression, against a synthetic talker whose appearance is a known function of its shape."""

from dataclasses import replace

import numpy as np
import pytest

from lexicon.errors import InputError
from lexicon.sequence import SILENCE, PhoneSequence
from tests.picture.test_plate import own_talker
from tts2face.face.appearance_regression import fit_appearance_regression
from tts2face.models.talker import Utterance
from tts2face.session.animated_face import OwnAppearanceFace
from tts2face.types import Trajectory


def test_a_linear_relation_is_recovered():
    generator = np.random.default_rng(0)
    talker = own_talker()
    mix, offset = generator.normal(size=(2, 4)), generator.normal(size=4)
    shape = generator.normal(0, 1, (500, 3)).astype(np.float32)
    appearances = (shape[:, :2] @ mix + offset).astype(np.float32)
    phones = PhoneSequence([SILENCE], [0.0, 20.0])
    spoken = Utterance("a", phones, (), shape, np.zeros((500, 6), np.float32), np.zeros(500, np.float32), appearances)
    regression = fit_appearance_regression(replace(talker, utterances=(spoken,)))
    motion = regression.motion(Trajectory(("shape0", "shape1"), [[0.5, -1.0], [0.0, 0.0]], 25.0))
    assert motion.channels == ("shape0", "shape1", "face0", "face1", "mouth0", "mouth1")
    assert motion.values[0, :2].tolist() == [0.5, -1.0]
    face = OwnAppearanceFace(talker, None, None, regression, None)
    np.testing.assert_allclose(face.landmarks(motion), talker.model.shapes(motion.values[:, :2]), atol=1e-5)  # mm
    assert np.abs(motion.values[:, 2:] - (np.array([[0.5, -1.0], [0.0, 0.0]]) @ mix + offset)).max() < 0.05


def test_motion_of_another_talker_is_refused():
    phones = PhoneSequence([SILENCE], [0.0, 0.4])
    still = np.zeros((10, 3), np.float32)
    spoken = Utterance(
        "a", phones, (), still, np.zeros((10, 6), np.float32), still[:, 0], np.zeros((10, 4), np.float32)
    )
    regression = fit_appearance_regression(replace(own_talker(), utterances=(spoken,)))
    with pytest.raises(InputError, match="transfer it to this talker first"):
        regression.motion(Trajectory(("jawOpen",), [[0.0]], 25.0))


def test_a_talker_without_appearance_is_refused():
    with pytest.raises(InputError, match="motion only"):
        fit_appearance_regression(own_talker(has_face=False))
