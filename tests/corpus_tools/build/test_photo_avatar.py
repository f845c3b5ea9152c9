"""Heads of people in pictures have the landmarks and colours of the pictures."""

import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from scipy.ndimage import gaussian_filter

from corpus_tools.dense.avatar import build_avatar, mirror_table, person_landmarks
from corpus_tools.dense.mesh_fit import face_landmarks
from corpus_tools.dense.person_look import part_colour
from lexicon.errors import InputError
from tests.corpus_tools.build.likeness import (
    SKIN,
    colours_apart,
    difference_2000,
    marks_apart,
    nearest,
    see_head,
    see_picture,
)
from tests.photo.pictures import still
from tts2face.models.face import Face
from tts2face.models.face_loading import load_face
from tts2face.models.landmarks import EYE_OUTER_LEFT, EYE_OUTER_RIGHT, N_LANDMARKS, N_MESH_LANDMARKS
from tts2face.photo.found_face import PhotoReader
from tts2face.picture.options import Picture
from tts2face.picture.renderer import draw
from tts2face.session.session import Session
from tts2face.video.media import read_frames
from tts2face.video.tracking import FaceTracker

SIDE = 480
FOLDS = (206, 426, 216, 436)  # landmarks beside the folds of a smile
PEOPLE = ("mara", "tomas", "noor")


@pytest.fixture(scope="module")
def photos(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("photos")
    for name in PEOPLE:
        Image.fromarray(still(name, SIDE)).save(folder / f"{name}.png")
    return {name: folder / f"{name}.png" for name in PEOPLE}


@pytest.fixture(scope="module")
def avatars(photos: dict[str, Path], tmp_path_factory: pytest.TempPathFactory, face_model: Path) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("avatars")
    for name, photo in photos.items():
        build_avatar([photo], folder / f"{name}.face", consent="nobody", model=face_model)
    return {name: folder / f"{name}.face" for name in photos}


def test_avatars_are_nearest_to_their_own_pictures(
    photos: dict[str, Path], avatars: dict[str, Path], face_model: Path
) -> None:
    check_likeness(list(photos.values()), list(avatars.values()), face_model)


def test_avatars_of_real_people_are_nearest_to_their_own_pictures(
    shared_recordings: Path, face_model: Path, tmp_path: Path
) -> None:
    photos, avatars = [], []
    for video in sorted((shared_recordings / "grid_talkers").glob("*.mpg"))[:3]:
        photos.append(tmp_path / f"{video.stem}.png")
        Image.fromarray(next(iter(read_frames(video))).pixels).save(photos[-1])
        avatars.append(photos[-1].with_suffix(".face"))
        build_avatar([photos[-1]], avatars[-1], consent="agreed: the speakers of GRID, 2006-01-01", model=face_model)
    check_likeness(photos, avatars, face_model)


def check_likeness(photos: list[Path], avatars: list[Path], face_model: Path) -> None:
    """Landmarks within 1.5 % of the width of the face, skin within a CIEDE2000 of 6 (medians), no other is nearer."""
    tracker, reader = FaceTracker(face_model), PhotoReader(face_model)
    shown = [reader.read(photo) for photo in photos]
    pictures = [see_picture(one.picture.pixels, one.found) for one in shown]
    heads = [see_head(load_face(str(path)), one, tracker)[1] for path, one in zip(avatars, shown, strict=True)]
    pairs = list(zip(heads, pictures, strict=True))
    assert np.median([marks_apart(*pair) for pair in pairs]) < 0.015
    assert np.median([colours_apart(*pair, SKIN) for pair in pairs]) < 6.0
    assert nearest(heads, pictures) == list(range(len(pairs)))


def test_colour_differences_are_those_of_the_paper() -> None:
    """Pairs 1, 7, 17, 20 and 25 of table 1 of Sharma, Wu and Dalal 2005."""
    pairs = np.array([
        ((50, 2.6772, -79.7751), (50, 0, -82.7485)), ((50, 0, 0), (50, -1, 2)), ((50, 2.5, 0), (73, 25, -18)),
        ((50, 2.5, 0), (58, 24, 15)), ((60.2574, -34.0099, 36.2677), (60.4626, -34.1751, 39.4387)),
    ])  # fmt: skip
    found = difference_2000(pairs[:, 0], pairs[:, 1])
    np.testing.assert_allclose(found, [2.0425, 2.3669, 27.1492, 19.4535, 1.2644], atol=1e-4)


def test_an_avatar_is_a_head_like_any_other(avatars: dict[str, Path]) -> None:
    path = avatars["tomas"]
    assert path.stat().st_size < 8_000_000
    face = load_face(str(path))
    assert face.metadata["consent"]["statement"] == "nobody"
    assert face.mark.notice
    clip = Session(face=face).clip("Hello.", fps=10)
    assert len(clip.motion) > 5
    turned = draw(face, picture=Picture(size="64x64", camera="three-quarter"))
    assert turned.std() > 10


def test_a_turned_and_smiling_head_has_its_own_shape(head: Face, face_model: Path, tmp_path: Path) -> None:
    tracker, path = FaceTracker(face_model), tmp_path / "head.png"
    Image.fromarray(still("head", SIDE, head=(4, 12, 3), mouthSmileLeft=0.7, mouthSmileRight=0.7)).save(path)
    rest = face_landmarks(head, head.vertices.astype(np.float64))[:N_MESH_LANDMARKS]
    found = person_landmarks(PhotoReader(face_model).read(path), head, tracker)
    assert np.linalg.norm(found - rest, axis=1).mean() < 2.0  # mm; landmarks as they are read are 5 off


def test_landmarks_have_partners_on_the_other_side(head: Face) -> None:
    table = mirror_table(head)
    assert table[EYE_OUTER_LEFT] == EYE_OUTER_RIGHT
    np.testing.assert_array_equal(table[table], np.arange(N_LANDMARKS))


def test_eyes_have_the_colour_that_is_chosen_and_wrinkles_stay_on_request(
    photos: dict[str, Path], avatars: dict[str, Path], face_model: Path, tmp_path: Path
) -> None:
    path = tmp_path / "noor.face"
    built = build_avatar([photos["noor"]], path, consent="nobody", eye_color="blue", age_keep=True, model=face_model)
    chosen, usual = load_face(str(path)), load_face(str(avatars["noor"]))
    assert "eyes: blue" in built.look.summary()
    assert re.match("hair: tied back, (white|grey); eyes: .*brown", str(usual.metadata["look"]))
    shown, before = (part_colour(face, "iris") for face in (chosen, usual))
    assert shown[2] > shown[0] + 10
    assert before[0] > before[2]
    assert _line_depth(chosen) > 1.1 * _line_depth(usual)
    with pytest.raises(InputError, match="there is no eye colour 'pink'; give #rrggbb or one of dark-brown, brown"):
        build_avatar([photos["noor"]], path, consent="nobody", eye_color="pink", model=face_model)


def _line_depth(face: Face) -> float:
    """Mean logarithm by which texels about the folds of the smile are darker than their surroundings."""
    texture = np.log(np.maximum(face.textures[0].pixels @ np.array([0.299, 0.587, 0.114]), 1.0))
    depth = gaussian_filter(texture, 14.0) - texture
    size = np.array(texture.shape[::-1])
    places = face.uv[face.landmark_vertices[np.isin(face.landmarks, FOLDS), 0]] * size
    return float(np.mean([
        np.clip(depth[y - 60 : y + 60, x - 60 : x + 60], 0.0, 0.35).mean() for x, y in places.astype(int)
    ]))  # fmt: skip


def test_consent_comes_first(photos: dict[str, Path], tmp_path: Path) -> None:
    with pytest.raises(InputError, match="state the consent"):
        build_avatar([photos["mara"]], tmp_path / "me.face", consent=None)


@pytest.fixture(scope="module")
def head() -> Face:
    return load_face("head", hair="bald")
