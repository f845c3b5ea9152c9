"""Recordings of every source on one clock: videos, Live Link captures, and their resampling."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from corpus_tools.decomposition.capture import (
    FaceRecording,
    find_capture_sound,
    read_capture_sound,
    resample,
    resample_to_gesture_rate,
)
from corpus_tools.decomposition.capture_files import read_livelink_recording
from corpus_tools.decomposition.recordings import read_sound_span
from lexicon.errors import DataError, InputError
from tests.face.posing import posed_vertices
from tests.rendered_takes import write_sound
from tts2face.face.landmarks import moved_landmarks, rest_landmarks
from tts2face.lips.performer import match_shapes
from tts2face.models.face import Face
from tts2face.models.landmarks import N_LANDMARKS
from tts2face.numeric.arrays import true_runs
from tts2face.types import Trajectory, Waveform
from tts2face.video.livelink import read_livelink


def still(n_frames: int, fps: float) -> FaceRecording:
    wave = np.sin(2 * np.pi * 2.0 * np.arange(n_frames) / fps)
    landmarks = np.ones((n_frames, N_LANDMARKS, 3), np.float32) * wave[:, None, None]
    return FaceRecording("made", fps, landmarks.astype(np.float32), np.zeros((n_frames, 6), np.float32))


@pytest.mark.parametrize("fps", [24.0, 25.0, 30.0, 60.0, 120.0])
def test_a_movement_keeps_its_time_and_size_at_thirty_frames(fps: float) -> None:
    read = resample_to_gesture_rate(still(round(fps * 4), fps))
    assert read.fps == 30.0
    expected = np.sin(2 * np.pi * 2.0 * np.arange(len(read.landmarks)) / 30.0)
    # A frame's mean of a 2 Hz movement is 0.7 % smaller than its middle; splines of 24 frames are nearer.
    assert np.abs(read.landmarks[1:-1, 0, 0] - expected[1:-1]).max() < 0.01
    assert abs(len(read.landmarks) / 30.0 - 4.0) <= 1 / 30.0


def test_resampling_does_not_alias() -> None:
    fps = 120.0
    fast = np.cos(2 * np.pi * 29.0 * np.arange(480) / fps)[:, None]  # every fourth frame of it: a movement at 1 Hz
    assert np.abs(fast[::4]).max() == 1.0
    assert np.abs(resample(fast, fps, 30.0)[2:-2]).max() < 0.05


def test_the_same_rate_changes_nothing_and_one_frame_stays_one() -> None:
    values = np.random.default_rng(1).normal(size=(20, 2, 3))
    np.testing.assert_allclose(resample(values, 25.0, 25.0), values, atol=1e-12)
    np.testing.assert_array_equal(resample(values[:1], 25.0, 30.0), values[:1])


def test_a_rate_of_nothing_is_refused() -> None:
    with pytest.raises(InputError, match="above 0"):
        resample(np.zeros((3, 2)), 25.0, 0.0)


def test_frames_without_a_face_are_refused() -> None:
    good = still(5, 30.0)
    gone = good.landmarks.copy()
    gone[2] = np.nan
    with pytest.raises(DataError, match="frames without a face"):
        replace(good, landmarks=gone)


def test_head_poses_of_another_length_are_refused() -> None:
    with pytest.raises(DataError, match="head poses"):
        replace(still(5, 30.0), head=np.zeros((4, 6), np.float32))


def test_an_unknown_feature_is_refused() -> None:
    with pytest.raises(InputError, match="no feature 'ears'"):
        replace(still(5, 30.0), missing_features=frozenset({"ears"}))


def test_landmarks_follow_the_face_s_own_posing(face: Face) -> None:
    generator = np.random.default_rng(2)
    weights = generator.uniform(0, 0.6, (4, len(face.shape_names)))
    found = moved_landmarks(face, Trajectory(face.shape_names, weights, 30.0))
    for row, places in zip(weights, found, strict=True):
        vertices = posed_vertices(face, row.astype(np.float32)).astype(float)
        expected = np.einsum("lk,lkd->ld", face.landmark_weights, vertices[face.landmark_vertices])
        np.testing.assert_allclose(places[face.landmarks], expected, atol=0.001)  # float32 of 100 mm


def test_weights_of_other_shapes_are_refused(face: Face) -> None:
    with pytest.raises(DataError, match="not for the shapes of this face"):
        moved_landmarks(face, Trajectory(("jawOpen",), np.zeros((2, 1)), 30.0))


def test_a_face_without_all_landmarks_is_refused(face: Face) -> None:
    fewer = replace(
        face,
        landmarks=face.landmarks[:-1],
        landmark_vertices=face.landmark_vertices[:-1],
        landmark_weights=face.landmark_weights[:-1],
    )
    with pytest.raises(DataError, match="477 of 478 landmarks"):
        rest_landmarks(fewer)


def test_a_live_link_capture_moves_the_face_with_its_head_and_sound(capture: Path, face: Face) -> None:
    found = read_livelink_recording(capture, face)
    assert found.fps == 60.0
    assert found.missing_features == frozenset()
    assert found.sound is not None
    assert found.sound.duration == pytest.approx(len(found.landmarks) / found.fps, abs=0.3)
    weights = match_shapes(read_livelink(capture).weights, face).values
    np.testing.assert_allclose(found.rest, rest_landmarks(face), atol=1e-4)
    jaw = weights[:, face.shape_names.index("jawOpen")]
    assert np.corrcoef(jaw, -found.landmarks[:, 152, 1])[0, 1] > 0.95
    read = resample_to_gesture_rate(found)
    assert len(read.landmarks) == (len(found.landmarks) + 1) // 2


def test_nothing_is_learnt_where_a_capture_has_no_face(face: Face, tmp_path: Path) -> None:
    times = np.arange(240) / 60 + (np.arange(240) > 120)
    lines = ["Time,JawOpen,BrowInnerUp", *(f"{time:.4f},{time % 1:.3f},0.1" for time in times)]
    (tmp_path / "take.csv").write_text("\n".join(lines))
    found = read_livelink_recording(tmp_path / "take.csv", face)
    assert found.left_out is not None
    assert true_runs(found.left_out).tolist() == [[121, 181]]
    left_out = resample_to_gesture_rate(found).left_out
    assert left_out is not None
    assert true_runs(left_out).tolist() == [[61, 91]]


def test_sound_of_the_same_name_is_found(tmp_path: Path) -> None:
    capture = tmp_path / "take.csv"
    assert read_capture_sound(capture) is None
    write_sound(tmp_path / "take.flac", 0.1 * np.sin(np.arange(22_050)), 44_100)
    found = read_capture_sound(capture)
    assert found is not None
    assert found.rate == 16_000


@pytest.mark.parametrize("begin", [0.5, -0.25])
def test_a_film_brings_its_sound_on_the_clock_of_its_frames(begin: float, monkeypatch: pytest.MonkeyPatch) -> None:
    ramp = np.arange(64_000, dtype=np.float32) / 64_000
    monkeypatch.setattr("corpus_tools.decomposition.recordings.read_sound", lambda path, rate: Waveform(ramp, rate))
    sound = read_sound_span(Path("film.mp4"), begin, 2.0)
    assert sound.duration == 2.0
    at = np.arange(len(sound.samples)) + round(begin * 16_000)
    np.testing.assert_array_equal(sound.samples, np.where(at < 0, 0.0, ramp[np.maximum(at, 0)]))


def test_a_single_sound_file_with_another_name_belongs_to_the_capture(tmp_path: Path) -> None:
    capture = tmp_path / "take.csv"
    (tmp_path / "room.wav").write_bytes(b"")
    assert find_capture_sound(capture) == tmp_path / "room.wav"
    (tmp_path / "lapel.wav").write_bytes(b"")
    with pytest.raises(InputError, match=r"there are 2 sound files beside take\.csv; give one of them"):
        find_capture_sound(capture)
    (tmp_path / "take.wav").write_bytes(b"")
    assert find_capture_sound(capture) == tmp_path / "take.wav"
