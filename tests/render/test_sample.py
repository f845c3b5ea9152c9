"""Sampling of a video at a texture's pixels, against a picture whose colours are a linear function of place."""

import numpy as np

from tests.render.test_plate import own_talker
from tts2face.render.plate_sampling import texture_samples


def test_a_linear_picture_is_read_exactly_through_any_affine_mesh() -> None:
    talker = own_talker()
    assert talker.appearance is not None
    face = talker.appearance.face
    turn, shift = np.array([[1.2, 0.3], [-0.2, 0.9]]), np.array([20.0, 30.0])
    y, x = np.mgrid[:120, :110]
    picture = np.stack([2 * x, y + 20, x + y], axis=2).astype(np.uint8)
    chosen = np.random.default_rng(0).random(len(face.pixels)) < 0.3
    taken = texture_samples(face, chosen)
    width = face.size[0]
    places = np.stack([face.pixels % width, face.pixels // width], axis=1)[taken.pixels]
    assert chosen[taken.pixels].all()
    assert len(taken.pixels) > 0.95 * chosen.sum()
    px, py = (places @ turn.T + shift).T
    known = np.stack([2 * px, py + 20, px + py], axis=1)
    np.testing.assert_allclose(taken.of(picture, face.reference @ turn.T + shift), known, atol=0.2)


def test_places_beyond_the_picture_take_its_edge() -> None:
    talker = own_talker()
    assert talker.appearance is not None
    face = talker.appearance.face
    taken = texture_samples(face, np.ones(len(face.pixels), bool))
    assert (taken.of(np.full((8, 8, 3), 7, np.uint8), face.reference + 1000) == 7).all()
