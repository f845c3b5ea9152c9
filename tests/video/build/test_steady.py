"""Steadying of tracked heads."""

from pathlib import Path

import numpy as np

from tts2face.video.media import TimedFrame, read_frames, read_media_info
from tts2face.video.streaming import StreamingTracker
from tts2face.video.tracking import FaceTracker

CLIP = "clips/bbaf2n.mkv"


def test_one_pass_reads_what_two_passes_read(takes: Path, face_model: Path) -> None:
    film = takes / CLIP
    fps = read_media_info(film).fps
    twice = FaceTracker(face_model).track(lambda: (picture.pixels for picture in read_frames(film)), fps)
    once = list(StreamingTracker(face_model).track(read_frames(film), fps))
    assert [sight.time for sight in once] == [picture.time for picture in read_frames(film)]
    np.testing.assert_allclose([sight.points for sight in once], twice.points, atol=1e-3)  # pixels


def test_blank_pictures_hold_no_face(face_model: Path) -> None:
    blank = (TimedFrame(i / 25, np.full((64, 64, 3), 90, np.uint8)) for i in range(3))
    assert all(np.isnan(sight.points).all() for sight in StreamingTracker(face_model).track(blank, 25.0))


def test_faces_are_counted_and_changes_measured(takes: Path, face_model: Path) -> None:
    plain = [picture.pixels for picture in read_frames(takes / CLIP)][:26]
    plain[5] = plain[4]
    both = [np.concatenate([pixels, pixels[:, ::-1]], axis=1) for pixels in plain]
    alone = list(StreamingTracker(face_model).track(_film(plain), 25.0))
    crowd = list(StreamingTracker(face_model).track(_film(both), 25.0))
    assert [sight.n_faces for sight in alone if sight.n_faces is not None] == [1, 1, 1]
    assert [sight.n_faces for sight in crowd if sight.n_faces is not None] == [2, 2, 2]
    assert [number for number, sight in enumerate(alone) if sight.n_faces is not None] == [0, 12, 24]
    assert alone[0].change == np.inf
    assert alone[5].change == 0.0
    assert min(sight.change for sight in alone[6:]) > 0.1


def test_landmarks_do_not_depend_on_the_size_of_the_picture(takes: Path, face_model: Path) -> None:
    plain = [picture.pixels for picture in read_frames(takes / CLIP)][:3]
    large = [pixels.repeat(8, axis=0).repeat(8, axis=1) for pixels in plain]
    small, grown = (list(StreamingTracker(face_model).track(_film(pictures), 25.0)) for pictures in (plain, large))
    wanted = (small[1].points[:, :2] + 0.5) * 8 - 0.5
    apart = (grown[1].points[:, :2] - wanted) / 8  # pixels of the small picture
    assert np.abs(np.median(apart, axis=0)).max() < 0.25  # the centre of a pixel is where it was
    assert np.quantile(np.abs(apart), 0.99) < 0.5
    assert np.abs(apart).max() < 1.0  # points of the forehead, which hair hides


def _film(pictures: list[np.ndarray]) -> list[TimedFrame]:
    return [TimedFrame(number / 25, pixels) for number, pixels in enumerate(pictures)]
