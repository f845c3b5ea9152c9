"""Soft shadows with known results: convex, enclosed and occluded surfaces."""

import dataclasses

import numpy as np
import pytest

from tests.picture.tiny_face import ball, tiny_face
from tts2face.models.face import FacePart
from tts2face.picture.light import compute_exposure, lamp_weights
from tts2face.picture.occlusion import bake_occlusion, sphere_directions
from tts2face.picture.surface import build_surface

LAMPS = np.array([[0, 0, 1.0], [1.0, 0, 0], [0, 1.0, 0]])


def face_of_bodies(*bodies):
    """A face that consists of spheres and has no shapes."""
    blank = tiny_face()
    starts = np.cumsum([0] + [len(points) for points, _ in bodies])
    vertices = np.vstack([points for points, _ in bodies]).astype(np.float32)
    triangles = np.vstack([t + s for (_, t), s in zip(bodies, starts[:-1], strict=True)]).astype(np.int32)
    counts = [len(t) for _, t in bodies]
    firsts = np.cumsum([0, *counts])
    return dataclasses.replace(
        blank,
        vertices=vertices,
        triangles=triangles,
        parts=tuple(FacePart(f"body{i}", int(firsts[i]), counts[i]) for i in range(len(bodies))),
        shape_names=(),
        shapes=np.zeros((0, len(vertices), 3), np.float32),
        limits=np.zeros((0, 2), np.float32),
        eyes=(),
        colours=np.full((len(vertices), 3), 200, np.uint8),
    )


def rest(*bodies):
    face = bake_occlusion(face_of_bodies(*bodies))
    return compute_exposure(face, build_surface(face), LAMPS, threads=1).rest


def test_a_single_ball_has_no_shadow():
    assert rest(ball((0, 0, 0), 80, 16)).min() > 0.93


def test_an_enclosed_ball_receives_no_light():
    shell, core = ball((0, 0, 0), 80, 16), ball((0, 0, 0), 30, 8)
    exposure = rest(shell, core)[len(shell[0]) :]
    assert exposure[:, 0].max() < 0.05
    assert exposure[:, 1:].min() < 0.05


def test_a_ball_in_front_hides_one_lamp_and_not_the_others():
    far, near = ball((0, 0, 0), 40, 12), ball((0, 0, 90), 40, 12)
    exposure = rest(far, near)
    facing = np.argmax(far[0][:, 2])
    assert exposure[facing, 1] < 0.1  # the lamp along z
    assert exposure[len(far[0]) + np.argmax(near[0][:, 2]), 1] > 0.9


def test_directions_are_unit_vectors_spread_evenly():
    np.testing.assert_allclose(np.linalg.norm(sphere_directions(40), axis=1), 1)
    np.testing.assert_allclose(sphere_directions(40).mean(axis=0), 0, atol=0.02)


def test_a_lamp_is_a_soft_lobe_of_directions_around_it():
    directions, lamp = sphere_directions(512), np.array([[0.6, 0.0, 0.8]])
    weights = lamp_weights(directions, lamp)[:, 0]
    assert weights.sum() == pytest.approx(1, abs=1e-5)
    assert np.arccos(directions[np.argmax(weights)] @ lamp[0]) < 0.15
    angles = np.arccos(np.clip(directions @ lamp[0], -1, 1))
    assert (weights * angles).sum() == pytest.approx(0.35, abs=0.05)  # 1.25 x the radius for a lobe on a sphere


@pytest.mark.parametrize("threads", [2, 3])
def test_occlusion_does_not_depend_on_the_number_of_threads(threads):
    face = tiny_face()
    single, many = (bake_occlusion(face, n).occlusion for n in (1, threads))
    np.testing.assert_array_equal(single, many)
