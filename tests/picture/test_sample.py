"""Sampling of a picture at texture pixels, against colours that are a linear function of position."""

import numpy as np

from tests.picture.test_plate import own_talker
from tts2face.picture.plate import texture_samples


def test_a_linear_picture_is_sampled_exactly_on_an_affine_mesh() -> None:
    talker = own_talker()
    assert talker.appearance is not None
    face = talker.appearance.face
    linear, shift = np.array([[1.2, 0.3], [-0.2, 0.9]]), np.array([20.0, 30.0])
    y, x = np.mgrid[:120, :110]
    picture = np.stack([2 * x, y + 20, x + y], axis=2).astype(np.uint8)
    chosen = np.random.default_rng(0).random(len(face.pixels)) < 0.3
    samples = texture_samples(face, chosen)
    width = face.size[0]
    places = np.stack([face.pixels % width, face.pixels // width], axis=1)[samples.pixels]
    assert chosen[samples.pixels].all()
    assert len(samples.pixels) > 0.95 * chosen.sum()
    px, py = (places @ linear.T + shift).T
    known = np.stack([2 * px, py + 20, px + py], axis=1)
    np.testing.assert_allclose(samples.of(picture, face.reference @ linear.T + shift), known, atol=0.2)


def test_positions_outside_the_picture_take_its_edge() -> None:
    talker = own_talker()
    assert talker.appearance is not None
    face = talker.appearance.face
    samples = texture_samples(face, np.ones(len(face.pixels), bool))
    assert (samples.of(np.full((8, 8, 3), 7, np.uint8), face.reference + 1000) == 7).all()
