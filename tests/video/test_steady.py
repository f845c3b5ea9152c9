from pathlib import Path

import numpy as np
import pytest

from lexicon.errors import DataError
from tts2face.video.media import Picture, media_facts, read_pictures
from tts2face.video.steady import FilmReader
from tts2face.video.track import FaceTracker

CLIP = "grid_s1/clips/bbaf2n.mkv"


def test_one_pass_reads_what_two_passes_read(shared_recordings: Path, face_model: Path) -> None:
    film = shared_recordings / CLIP
    fps = media_facts(film).fps
    twice = FaceTracker(face_model).track(lambda: (picture.pixels for picture in read_pictures(film)), fps)
    once = list(FilmReader(face_model).sights(read_pictures(film), fps))
    assert [sight.time for sight in once] == [picture.time for picture in read_pictures(film)]
    np.testing.assert_allclose([sight.points for sight in once], twice.points, atol=1e-3)  # pixels


def test_blank_pictures_hold_no_face(face_model: Path) -> None:
    blank = (Picture(i / 25, np.full((64, 64, 3), 90, np.uint8)) for i in range(3))
    assert all(np.isnan(sight.points).all() for sight in FilmReader(face_model).sights(blank, 25.0))


def test_two_faces_are_refused(shared_recordings: Path, face_model: Path) -> None:
    both = (
        Picture(picture.time, np.concatenate([picture.pixels, picture.pixels[:, ::-1]], axis=1))
        for picture in read_pictures(shared_recordings / CLIP)
    )
    with pytest.raises(DataError, match=r"two faces at 0\.5 s"):
        list(FilmReader(face_model).sights(both, 25.0))
