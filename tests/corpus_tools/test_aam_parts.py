"""Parts of appearance models against closed forms and independent implementations."""

from pathlib import Path

import numpy as np
import pytest

from corpus_tools.appearance.frame import (
    MOUTH_LANDMARKS,
    barycentric_coordinates,
    build_reference_frame,
    face_ring,
    face_triangles,
    mouth_triangles,
)
from corpus_tools.appearance.lighting import fit_lighting
from corpus_tools.appearance.pca import IncrementalPca
from corpus_tools.appearance.procrustes import align_shapes, apply_similarities, fit_similarities
from corpus_tools.appearance.train import camera_axes, speech_weights
from corpus_tools.appearance.videos import AppearanceRecording, build_appearance_recording
from corpus_tools.recordings.observation import Observation, Quality
from corpus_tools.recordings.video import TrackedVideo
from lexicon.errors import InputError
from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.models.consent import consent_record
from tts2face.models.landmarks import FACE_OVAL, INNER_LIP_LOWER, INNER_LIP_UPPER
from tts2face.numeric.arrays import points_in_polygon
from tts2face.picture.own_face import ring_triangles
from tts2face.video.tracking import Tracking


def transform(shape, angle, size, shift):
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return size * shape @ turn.T + shift


def test_turned_copies_of_a_shape_are_aligned_onto_one_another():
    shape = np.random.default_rng(0).normal(0, 30, (20, 2))
    copies = np.array([transform(shape, 0.1 * k, 1 + 0.05 * k, (3 * k, -k)) for k in range(6)])
    placed, mean = align_shapes(copies)
    assert np.abs(placed - placed[0]).max() < 1e-9
    assert np.abs(placed[0] - mean).max() < 1e-9


def test_a_similarity_is_found_again():
    shape = np.random.default_rng(1).normal(0, 30, (20, 2))
    target = transform(shape, 0.4, 1.7, (5.0, -9.0))
    assert np.abs(apply_similarities(shape[None], *fit_similarities(shape[None], target))[0] - target).max() < 1e-9


@pytest.mark.parametrize("blocks", [(60,), (7, 20, 33), (30, 30)])
def test_components_block_by_block_are_those_of_all_rows(blocks):
    generator = np.random.default_rng(2)
    rows = generator.normal(size=(60, 3)) @ generator.normal(size=(3, 40)) * 5 + generator.normal(0, 0.01, (60, 40)) + 9
    grown = IncrementalPca(10)
    for block in np.split(rows, np.cumsum(blocks)[:-1]):
        grown.add(block)
    centred = rows - rows.mean(axis=0)
    _, scales, basis = np.linalg.svd(centred, full_matrices=False)
    assert np.abs(grown.mean - rows.mean(axis=0)).max() < 1e-5
    assert np.allclose(grown.spread()[:3], scales[:3] / np.sqrt(60), rtol=1e-3)
    assert np.allclose(np.abs((grown.basis[:3] * basis[:3]).sum(axis=1)), 1, atol=1e-4)
    assert np.allclose(grown.explained_variance()[:3], np.cumsum(scales**2)[:3] / (scales**2).sum(), atol=1e-4)
    assert np.abs(grown.basis @ grown.basis.T - np.eye(len(grown.basis))).max() < 1e-3


def test_a_texture_does_not_depend_on_where_the_face_is():
    shape = np.array([[0.0, 0], [40, 2], [20, 50], [22, 20]])
    triangles = np.array([(0, 1, 3), (1, 2, 3), (2, 0, 3)], np.int32)
    frame = build_reference_frame(shape, triangles, 32)
    y, x = np.mgrid[:200, :200]
    for angle, size, shift in ((0.0, 1.0, (30.0, 30.0)), (0.3, 1.5, (60.0, 40.0))):
        points = transform(shape, angle, size, shift)
        back = transform(np.stack([x, y], axis=-1).reshape(-1, 2) - np.array(shift), -angle, 1 / size, 0.0)
        ramp = np.clip(back @ (2.0, 1.0) + 60, 0, 255).reshape(200, 200)
        picture = np.repeat(ramp[:, :, None], 3, axis=2)
        texture = frame.texture(picture, points)
        pixels = np.stack([frame.pixels % frame.size[0], frame.pixels // frame.size[0]], axis=1)
        corner = np.linalg.lstsq(np.column_stack([frame.points, np.ones(4)]), shape, rcond=None)[0]
        wanted = np.column_stack([pixels, np.ones(len(pixels))]) @ corner @ (2.0, 1.0) + 60
        assert np.abs(texture[:, 0] - wanted).max() < 0.01


def test_barycentric_coordinates_give_the_place_back():
    corners = np.array([[0.0, 0], [10, 1], [3, 8]])
    places = np.random.default_rng(0).uniform(-5, 10, (50, 2))
    weights = barycentric_coordinates(places, corners)
    assert np.abs(weights @ corners - places).max() < 1e-9
    assert np.abs(weights.sum(axis=1) - 1).max() < 1e-9


def test_points_inside_a_polygon_agree_with_the_winding_number():
    polygon = np.array([[0.0, 0], [10, 0], [10, 10], [5, 3], [0, 10]])
    places = np.array([[5.0, 1], [5, 5], [1, 8], [11, 5], [-1, 1]])
    assert points_in_polygon(places, polygon).tolist() == [True, False, True, False, False]


def test_the_mouth_s_triangles_fill_the_inner_lips_and_no_more():
    shape = np.zeros((478, 2))
    angles = np.linspace(0, np.pi, 11)
    shape[list(INNER_LIP_UPPER)] = np.stack([-np.cos(angles), -np.sin(angles)], axis=1)
    shape[list(INNER_LIP_LOWER)] = np.stack([-np.cos(angles), np.sin(angles)], axis=1)
    ring_of_lips = shape[list(MOUTH_LANDMARKS)]
    corners = ring_of_lips[mouth_triangles()]
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    areas = np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) / 2
    x, y = ring_of_lips.T
    outline = abs((x * np.roll(y, -1) - np.roll(x, -1) * y).sum()) / 2
    assert areas.sum() == pytest.approx(outline)


def test_the_ring_surrounds_the_face_oval():
    shape = np.random.default_rng(0).normal(0, 5, (468, 2))
    angles = np.linspace(0, 2 * np.pi, len(FACE_OVAL), endpoint=False)
    shape[list(FACE_OVAL)] = 40 * np.stack([np.sin(angles), -np.cos(angles)], axis=1)
    assert not points_in_polygon(face_ring(shape), shape[list(FACE_OVAL)]).any()
    assert len(np.unique(ring_triangles(468))) == 2 * len(FACE_OVAL)
    triangles = face_triangles(shape)
    assert points_in_polygon(shape[triangles].mean(axis=1), shape[list(FACE_OVAL)]).all()


def test_a_light_is_found_again_on_the_pixels_that_stay():
    generator = np.random.default_rng(0)
    texture = generator.uniform(40, 160, (300, 3)).astype(np.float32)
    reference = texture * (1.2, 0.9, 1.0) + np.array((3.0, -4.0, 8.0))
    reference[:100] += 50  # the mouth moved
    still = np.arange(300) >= 100
    found = fit_lighting(texture, reference.astype(np.float32), still)
    assert np.abs(found.gain - (1.2, 0.9, 1.0)).max() < 1e-4
    assert np.abs(found.apply(texture)[100:] - reference[100:]).max() < 0.01


def test_speech_changes_the_mouth_and_neither_forehead_nor_outline():
    generator = np.random.default_rng(3)
    shape = generator.uniform(-30, 30, (468, 2))
    angles = np.linspace(0, 2 * np.pi, len(FACE_OVAL), endpoint=False)
    shape[list(FACE_OVAL)] = 60 * np.stack([np.sin(angles), -np.cos(angles)], axis=1)
    lips = np.linspace(0, 2 * np.pi, len(MOUTH_LANDMARKS), endpoint=False)
    shape[list(MOUTH_LANDMARKS)] = np.stack([-8 * np.cos(lips), 20 - 4 * np.sin(lips)], axis=1)
    frame = build_reference_frame(shape, face_triangles(shape), 64)
    weight = speech_weights(frame)
    assert 0 <= weight.min() <= weight.max() <= 1
    nearest = frame.weights.argmax(axis=1)
    at = frame.corners[np.arange(len(nearest)), nearest]
    sure = frame.weights.max(axis=1) > 0.95
    assert weight[sure & np.isin(at, FACE_OVAL)].max(initial=0) < 0.1
    assert weight[sure & np.isin(at, MOUTH_LANDMARKS)].min(initial=1) > 0.5


def test_picture_axes_are_those_of_the_camera():
    generator = np.random.default_rng(0)
    landmarks = generator.normal(0, 40, (4, 478, 3))
    axes = np.array([[1.3, 0.1, 0.0], [0.0, -1.2, 0.3]])
    points = landmarks @ axes.T + np.array([90.0, 120.0])
    assert np.abs(camera_axes(points, landmarks) - axes).max() < 1e-4


def test_pictures_come_at_the_instants_of_the_frames(tmp_path, monkeypatch):
    shown = [type("Picture", (), {"time": t, "pixels": np.full((2, 2, 3), k, np.uint8)}) for k, t in
             enumerate([0.0, 0.04, 0.08, 0.2, 0.24])]  # fmt: skip
    monkeypatch.setattr("corpus_tools.appearance.videos.read_frames", lambda path: iter(shown))
    nothing = np.zeros((5, 478, 3), np.float32)
    film = AppearanceRecording(tmp_path / "x.mkv", 0.04, 25.0, nothing[:, :, :2], nothing, nothing[:, 0])
    assert [int(pixels[0, 0, 0]) for pixels in film.pictures()] == [1, 2, 2, 2, 3]


def test_landmarks_in_the_picture_come_at_the_instants_of_the_observation():
    """Videos of one person may have other rates than the one at which all of them are observed."""
    times = np.arange(140) / 24.0
    points = np.repeat(times[:, None, None], 478, axis=1).repeat(3, axis=2).astype(np.float32)
    tracked = TrackedVideo(Tracking(points, np.ones(140)), times, 24.0, np.ones(140), np.zeros(140))
    tracker = type("Tracker", (), {"track": lambda self, video: tracked})()
    landmarks, one_phone = np.zeros((130, 478, 3), np.float32), PhoneSequence([SILENCE], [0.0, 5.2])
    seen = Observation("a", 25.0, landmarks, landmarks[:, :2, 0], one_phone, (), landmarks[:, 0, 0],
                       Quality(1.0, 1.0, 0, 0.4), Path("a.webm"))  # fmt: skip
    film = build_appearance_recording(seen, landmarks[:, 0], tracker)
    assert (film.fps, len(film.points)) == (25.0, 130)
    assert np.abs(film.points[:, 0, 0] - (0.4 + np.arange(130) / 25.0)).max() < 1e-4


@pytest.mark.parametrize("statement", [None, "", "yes"])
def test_pictures_of_a_person_need_a_statement(statement):
    with pytest.raises(InputError, match="state the consent"):
        consent_record("Ada", statement)


def test_a_consent_is_kept_with_name_and_date():
    kept = consent_record("Ada", " Me, for a test. ", date="2026-01-02")
    assert kept == {"name": "Ada", "statement": "me: for a test.", "date": "2026-01-02"}
