"""Transfer of appearance parameters between talkers, against textures with a known result."""

from dataclasses import replace

import numpy as np

from corpus_tools.appearance.frame import build_reference_frame, face_triangles
from corpus_tools.appearance.transfer import build_appearance_transfer
from tests.picture.tiny_talker import face_points, own_talker
from tts2face.models.appearance import Appearance, TextureModel


def wave_texture(stretch: float, side: int, across: float) -> TextureModel:
    """A texture model with one component: a wave over the landmarks' places on one face, whatever shape is shown."""
    shape = face_points()
    frame = build_reference_frame(shape * (1.0, stretch), face_triangles(shape * (1.0, stretch)), side)
    places = (frame.weights[:, :, None] * (shape / 96.0)[frame.corners]).sum(axis=1)
    wave = np.cos(6 * np.pi * (across * places[:, 0] + (1 - across) * places[:, 1]))
    basis = np.repeat(wave[None, :, None], 3, axis=2)
    n_pixels = len(frame.pixels)
    return TextureModel(
        reference=frame.points,
        triangles=frame.triangles,
        size=frame.size,
        pixels=frame.pixels,
        mean=np.zeros((n_pixels, 3), np.float32),
        basis=(basis / np.linalg.norm(basis)).astype(np.float32),
        spread=np.full(1, 10.0, np.float32),
    )


def looking(face: TextureModel) -> Appearance:
    appearance = own_talker().appearance
    assert appearance is not None
    return replace(appearance, face=face)


def test_the_same_paint_on_a_larger_and_longer_face_keeps_its_size() -> None:
    """5 %: the frames sample the wave at other places. Components have length 1, however many pixels they have."""
    small, large = wave_texture(1.0, 48, 1.0), wave_texture(1.2, 90, 1.0)
    found = build_appearance_transfer(looking(small), looking(large)).relation
    grown = np.sqrt(len(large.pixels) / len(small.pixels))
    assert abs(found[0, 0] / grown - 1.0) < 0.05
    assert not found[0, 1:].any()
    assert not found[1:, 0].any()


def test_paint_that_the_target_does_not_have_is_lost() -> None:
    found = build_appearance_transfer(looking(wave_texture(1.0, 64, 1.0)), looking(wave_texture(1.0, 64, 0.0))).relation
    assert abs(found[0, 0]) < 0.2


def test_parameters_stay_within_three_spreads_and_follow_the_gain() -> None:
    face = looking(wave_texture(1.0, 48, 1.0))
    made = build_appearance_transfer(face, face)
    parameters = np.array([[4.0, 0.0, 0.0]])
    np.testing.assert_allclose(made.parameters(parameters, gain=2.0), 2 * made.parameters(parameters), rtol=1e-6)
    np.testing.assert_allclose(made.parameters(parameters)[0, 0], 4.0, rtol=1e-4)
    assert made.parameters(100 * parameters)[0, 0] == 30.0
