"""Heads of people in pictures have the landmarks and colours of the pictures."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from corpus_tools.dense.photo_avatar import build_avatar, mirror_table, without_expression
from lexicon.errors import InputError
from tests.photo.pictures import still
from tts2face.models.face import Face
from tts2face.models.face_loading import load_face
from tts2face.models.landmarks import EYE_OUTER_LEFT, EYE_OUTER_RIGHT, FACE_OVAL, N_LANDMARKS, N_MESH_LANDMARKS
from tts2face.render.draw import draw
from tts2face.render.picture import Picture
from tts2face.session import Session
from tts2face.video.pose import similarity_transforms
from tts2face.video.track import FaceTracker

SIDE = 480
PEOPLE = ("mara", "tomas", "noor")
CHEEKS = (50, 280, 205, 425)


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
        build_avatar([photo], folder / f"{name}.face", consent="drawn", model=face_model)
    return {name: folder / f"{name}.face" for name in photos}


def seen(pixels: np.ndarray, tracker: FaceTracker) -> tuple[np.ndarray, np.ndarray]:
    """Landmarks (468, 2) of a face, pixels, and the mean colours (4, 3) of its cheeks."""
    points = tracker.read(pixels)[0]
    places = np.rint(points[list(CHEEKS), :2]).astype(int)
    colours = [pixels[y - 4 : y + 5, x - 4 : x + 5].reshape(-1, 3).mean(axis=0) for x, y in places]
    return points[:N_MESH_LANDMARKS, :2], np.array(colours)


def apart(one: np.ndarray, other: np.ndarray) -> float:
    """Median distance of landmarks (468, 2) after a similarity, of the width of the face."""
    weights = np.full(len(one), 1 / len(one))
    flat = np.column_stack([one, np.zeros(len(one))]), np.column_stack([other, np.zeros(len(other))])
    turns, scales = similarity_transforms(flat[0][None], flat[1], weights)
    placed = scales[0] * (flat[0] - flat[0].mean(axis=0)) @ turns[0].T + flat[1].mean(axis=0)
    width = np.ptp(other[list(FACE_OVAL), 0])
    return float(np.median(np.linalg.norm(placed - flat[1], axis=1)) / width)


def test_avatars_have_the_proportions_and_the_skin_of_their_pictures(
    photos: dict[str, Path], avatars: dict[str, Path], face_model: Path
) -> None:
    tracker = FaceTracker(face_model)
    pictures = {name: seen(np.asarray(Image.open(path)), tracker) for name, path in photos.items()}
    for name, path in avatars.items():
        face = load_face(str(path))
        points, colours = seen(draw(face, picture=Picture(size=f"{SIDE}x{SIDE}")), tracker)
        distances = {other: apart(points, shown[0]) for other, shown in pictures.items()}
        assert distances[name] < 0.02
        assert distances[name] < np.mean([away for other, away in distances.items() if other != name])
        assert np.abs(colours - pictures[name][1]).mean() < 45


def test_an_avatar_is_a_head_like_any_other(avatars: dict[str, Path]) -> None:
    path = avatars["tomas"]
    assert path.stat().st_size < 8_000_000
    face = load_face(str(path))
    assert face.metadata["consent"]["statement"] == "drawn"
    assert face.synthetic_notice
    clip = Session(face=face).clip("Hello.", fps=10)
    assert len(clip.motion) > 5
    turned = draw(face, picture=Picture(size="64x64", camera="three-quarter"))
    assert turned.std() > 10


def test_expressions_are_taken_back(head: Face) -> None:
    rest = np.zeros((N_LANDMARKS, 3))
    still_face = without_expression(rest, {"jawOpen": 0.05}, head)
    np.testing.assert_array_equal(still_face, rest)
    opened = without_expression(rest, {"jawOpen": 0.6}, head)
    assert opened[152, 1] > 5  # the chin is higher than it was seen


def test_landmarks_have_partners_on_the_other_side(head: Face) -> None:
    table = mirror_table(head)
    assert table[EYE_OUTER_LEFT] == EYE_OUTER_RIGHT
    np.testing.assert_array_equal(table[table], np.arange(N_LANDMARKS))


def test_consent_comes_first(photos: dict[str, Path], tmp_path: Path) -> None:
    with pytest.raises(InputError, match="state the consent"):
        build_avatar([photos["mara"]], tmp_path / "me.face", consent=None)


@pytest.fixture(scope="module")
def head() -> Face:
    return load_face("head", hair="bald")
