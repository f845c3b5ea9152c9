"""Light fields: visibility as harmonics against the bits that they are fitted to."""

from dataclasses import replace

import numpy as np

from tests.picture.tiny_face import tiny_face
from tts2face.picture.light_fields import N_HARMONICS, harmonics, light_fields
from tts2face.picture.occlusion import bake_occlusion, sphere_directions
from tts2face.picture.surface import build_surface


def test_harmonics_are_independent_on_the_sphere():
    values = harmonics(sphere_directions(4096))
    product = values.T @ values / len(values)
    scale = np.sqrt(np.diag(product))
    assert (
        np.abs(product / np.outer(scale, scale) - np.eye(N_HARMONICS)).max() < 0.01
    )  # of an integral over 4096 places


def test_open_vertices_see_all_light_and_hidden_ones_none():
    face = tiny_face()
    bits = np.zeros((2, len(face.vertices), 16), np.uint8)
    bits[:, 0] = 255
    surface = build_surface(_with_occlusion(face, bits))
    field = light_fields(surface=surface, face=_with_occlusion(face, bits), threads=1)
    directions = sphere_directions(500)
    far = np.flatnonzero(~np.isin(np.arange(len(face.vertices)), _around(surface, 0)))
    seen = field[far, 1:10] @ harmonics(directions).T
    np.testing.assert_allclose(seen, 1.0, rtol=0, atol=1e-4)  # float32 sums of 128 directions
    np.testing.assert_allclose(field[far, 0], 1.0, rtol=0, atol=1e-5)
    assert field[0, 0] < 1


def test_a_half_hidden_vertex_sees_the_other_half():
    face = tiny_face()
    hidden = sphere_directions(128)[:, 0] > 0
    bits = np.tile(np.packbits(hidden), (2, len(face.vertices), 1))
    face = _with_occlusion(face, bits)
    field = light_fields(face, build_surface(face), threads=1)
    left, right = (field[:, 1:10] @ harmonics(np.array([[side, 0.0, 0.0]])).T for side in (-0.9, 0.9))
    assert (left > right + 0.8).all()


def test_the_change_with_an_open_mouth_is_that_of_its_pose():
    face = bake_occlusion(tiny_face())
    rest = face.occlusion[0]
    shut = light_fields(_with_occlusion(face, np.stack([rest, rest])), build_surface(face), 1)
    both = light_fields(face, build_surface(face), 1)
    assert np.abs(shut[:, 10:]).max() < 0.6  # of normals alone, and of the least light of teeth
    np.testing.assert_allclose(both[:, :10], shut[:, :10], rtol=0, atol=1e-6)


def _with_occlusion(face, bits):
    return replace(face, occlusion=bits)


def _around(surface, vertex):
    """Vertices within four edges of a vertex."""
    near = {vertex}
    for _ in range(4):
        near |= set(surface.triangles[np.isin(surface.triangles, list(near)).any(axis=1)].ravel().tolist())
    return list(near)
