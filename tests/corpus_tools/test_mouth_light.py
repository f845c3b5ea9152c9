"""Light scattered inside the mouth."""

from dataclasses import replace

import numpy as np
import pytest

from corpus_tools.shipped.head.mouth_light import mouth_vertices, scatter_in_mouth
from corpus_tools.shipped.head.skin import HeadSkin
from tests.picture.tiny_face import tiny_face
from tts2face.picture.occlusion import sphere_directions

N_DIRECTIONS = 128


@pytest.fixture
def hidden_face():
    """A face of which every vertex is hidden from everywhere, except at the back with an open mouth."""
    face = tiny_face()
    bits = np.ones((2, len(face.vertices), N_DIRECTIONS), np.uint8)
    bits[1, :, sphere_directions(N_DIRECTIONS)[:, 2] < -0.5] = 0
    return replace(face, occlusion=np.packbits(bits, axis=2))


@pytest.fixture
def skin():
    uv = np.array([[0.5, 0.5], [0.8, 0.05]])  # the second vertex is on the cavity's island
    return HeadSkin(np.zeros((2, 3)), {}, np.zeros((0, 4), np.int64), uv, np.zeros((2, 3)))


def test_the_mouth_is_its_parts_and_the_cavity(hidden_face, skin):
    tongue = next(part for part in hidden_face.parts if part.name == "tongue")
    inside = mouth_vertices(hidden_face, skin)
    own = np.unique(hidden_face.triangles[tongue.first : tongue.first + tongue.count])
    assert inside.tolist() == sorted({1, *own.tolist()})


def test_light_from_ahead_enters_the_mouth_alone(hidden_face, skin):
    lit = np.unpackbits(scatter_in_mouth(hidden_face, skin).occlusion, axis=2)
    before = np.unpackbits(hidden_face.occlusion, axis=2)
    inside = mouth_vertices(hidden_face, skin)
    outside = np.setdiff1d(np.arange(len(hidden_face.vertices)), inside)
    assert np.array_equal(lit[:, outside], before[:, outside])
    ahead = sphere_directions(N_DIRECTIONS)[:, 2] > 0.2
    assert 0.15 < 1 - lit[:, inside][:, :, ahead].mean() < 0.85
    assert np.array_equal(lit[0, inside], lit[1, inside])  # at rest the mouth is as with open lips
    assert np.array_equal(lit[1, inside][:, ~ahead], before[1, inside][:, ~ahead])


def test_a_face_without_occlusion_is_unchanged(hidden_face, skin):
    plain = replace(hidden_face, occlusion=None)
    assert scatter_in_mouth(plain, skin) is plain
