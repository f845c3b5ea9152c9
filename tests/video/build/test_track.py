"""Tracking of faces in videos."""

from pathlib import Path

import numpy as np
import pytest

from lexicon.errors import BackendError, DataError, InputError
from tts2face.video import networks as model
from tts2face.video.blendshapes import BLENDSHAPES, INPUT_LANDMARKS, BlendshapeReader
from tts2face.video.media import read_frames
from tts2face.video.tracking import Crop, FaceTracker, crop_around, smooth_crops


@pytest.fixture(scope="module")
def clip(takes: Path) -> list[np.ndarray]:
    return [picture.pixels for picture in read_frames(takes / "clips" / "bbaf2n.mkv")]


@pytest.fixture(scope="module")
def tracking(face_model: Path, clip):
    return FaceTracker(face_model).track(lambda: clip, 25.0)


def test_every_frame_of_a_clip_is_read(tracking, clip):
    assert tracking.points.shape == (len(clip), 478, 3)
    assert not tracking.is_missing.any()
    assert tracking.scores.min() > 0.99


def test_lips_meet_at_bilabials_and_open_at_vowels(tracking, takes):
    eyes = np.linalg.norm(tracking.points[:, 33, :2] - tracking.points[:, 263, :2], axis=1)
    gap = np.linalg.norm(tracking.points[:, 13, :2] - tracking.points[:, 14, :2], axis=1) / eyes
    words = [line.split() for line in (takes / "align" / "bbaf2n.align").read_text().splitlines()]
    (blue,) = (int(begin) / 25_000 for begin, _, word in words if word == "blue")
    around = slice(round((blue - 0.08) * 25), round((blue + 0.12) * 25))  # its /b/ by the word times
    assert gap[around].min() < 0.01
    assert gap.max() > 0.1


def test_blank_frames_are_missing_and_the_others_are_found_again(face_model, clip):
    grey = np.full_like(clip[0], 128)
    pictures = [grey, grey, *clip[:5], grey, *clip[5:8]]
    found = FaceTracker(face_model).track(lambda: pictures, 25.0)
    assert found.is_missing.nonzero()[0].tolist() == [0, 1, 7]
    assert found.scores[[0, 1, 7]].tolist() == [0, 0, 0]


def test_one_picture_by_itself(face_model, clip, tracking):
    points, score = FaceTracker(face_model).read(clip[0])
    assert score > 0.99
    assert np.abs(points - tracking.points[0])[:, :2].max() < 3  # pixels; one square against two smoothed ones


def test_a_landscape_has_no_face(face_model):
    noise = np.random.default_rng(0).integers(0, 255, (120, 160, 3), dtype=np.uint8)
    points, score = FaceTracker(face_model).read(noise)
    assert np.isnan(points).all()
    assert score < 0.5


def test_no_picture(face_model):
    with pytest.raises(DataError, match="no picture"):
        FaceTracker(face_model).track(list, 25.0)


def test_jaw_open_follows_the_lips(face_model, tracking, takes):
    reader = BlendshapeReader(face_model)
    scores = np.array([reader.blendshape_scores(points) for points in tracking.points])
    gap = np.linalg.norm(tracking.points[:, 13, :2] - tracking.points[:, 14, :2], axis=1)
    assert scores.shape == (len(tracking.points), 52)
    least = (
        0.85 if takes.name == "rendered_takes" else 0.9
    )  # the network was trained on people; 0.88 on a rendered head
    assert np.corrcoef(scores[:, BLENDSHAPES.index("jawOpen")], gap)[0, 1] > least


def test_blendshapes_of_half_a_face(face_model):
    with pytest.raises(InputError, match="finite landmarks"):
        BlendshapeReader(face_model).blendshape_scores(np.zeros((468, 3)))


def test_tables_of_the_blendshape_network():
    assert len(set(BLENDSHAPES)) == 52
    assert len(set(INPUT_LANDMARKS)) == 146


def test_squares_are_smoothed_without_lag_and_never_across_a_gap():
    line = [Crop(10.0 + i, 20.0, 100.0, 0.1) for i in range(40)]
    smooth = smooth_crops([*line, None, *line], 25.0)
    assert smooth[40] is None
    inner = [crop.x for crop in smooth[15:25] if crop]
    np.testing.assert_allclose(
        inner, [25.0 + i for i in range(10)], atol=1e-3
    )  # pixels; a straight line stays where it is
    assert smooth[:40] == smooth[41:]


def test_a_turn_through_half_a_circle_is_smooth():
    crops = [Crop(0.0, 0.0, 1.0, np.pi - 0.05), Crop(0.0, 0.0, 1.0, -np.pi + 0.05)] * 10
    assert all(abs(crop.angle - np.pi) < 0.06 for crop in smooth_crops(crops, 25.0) if crop)


@pytest.mark.parametrize("angle", [0.0, 0.3, -1.2])
def test_the_square_turns_with_the_face(angle):
    generator = np.random.default_rng(1)
    points = np.column_stack([generator.uniform(-50, 50, (478, 2)), np.zeros(478)])
    points[33, :2], points[263, :2] = (-30, 0), (30, 0)
    upright = crop_around(points)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    turned = points.copy()
    turned[:, :2] = points[:, :2] @ turn.T
    crop = crop_around(turned)
    assert crop.angle == pytest.approx(angle)
    assert crop.side == pytest.approx(upright.side)
    np.testing.assert_allclose([crop.x, crop.y], turn @ (upright.x, upright.y), atol=1e-9)


def test_without_the_model_the_message_names_the_command(monkeypatch, tmp_path):
    monkeypatch.delenv(model.MODEL_VARIABLE, raising=False)
    monkeypatch.setattr(model, "user_cache", lambda: tmp_path)
    monkeypatch.setattr(model, "BUNDLING_PACKAGES", ("no_such_package",))
    with pytest.raises(BackendError, match="run `tts2face corpus setup`"):
        model.find_bundle()


def test_another_model_is_refused(tmp_path):
    (tmp_path / "face_landmarker.task").write_bytes(b"something else")
    with pytest.raises(DataError, match=r"is not the face_landmarker\.task"):
        model.find_bundle(tmp_path / "face_landmarker.task")


def test_a_missing_model_path_is_refused(tmp_path):
    with pytest.raises(InputError, match="there is no face model"):
        model.find_bundle(tmp_path / "none.task")


def test_a_package_that_carries_the_model_is_found_without_importing_it(monkeypatch, tmp_path, face_model):
    package = tmp_path / "carrier_of_faces"
    package.mkdir()
    (package / "__init__.py").write_text("raise RuntimeError('must not be imported')")
    (package / "face_landmarker_v2.task").write_bytes(face_model.read_bytes())
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.delenv(model.MODEL_VARIABLE, raising=False)
    monkeypatch.setattr(model, "user_cache", lambda: tmp_path / "cache")
    monkeypatch.setattr(model, "BUNDLING_PACKAGES", ("carrier_of_faces",))
    assert model.find_bundle() == package / "face_landmarker_v2.task"
