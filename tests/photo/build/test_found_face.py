"""Faces of pictures are found with their pose and size, and what cannot be moved is refused in one sentence."""

from pathlib import Path

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from lexicon.errors import DataError, InputError
from tests.face.people import DRAWN, REALISTIC
from tests.photo.pictures import projected, still
from tts2face.models.landmarks import EYE_OUTER_LEFT, EYE_OUTER_RIGHT, N_MESH_LANDMARKS, UPPER_LIP_INNER_MID
from tts2face.photo.found_face import FoundFace, find_face
from tts2face.video.tracking import Crop, FaceTracker

SIDE = 480
CHEEKS = (50, 280, 205, 425)  # landmarks


@pytest.fixture(scope="module")
def tracker(face_model: Path) -> FaceTracker:
    return FaceTracker(face_model)


def found(pixels: np.ndarray, tracker: FaceTracker, **options: object) -> FoundFace:
    return find_face(pixels, tracker, "me.png", **options)


@pytest.mark.parametrize("name", [*DRAWN, *REALISTIC, "head"])
def test_landmarks_lie_where_the_face_has_them(name: str, tracker: FaceTracker) -> None:
    shown = found(still(name, SIDE), tracker)
    wanted = projected(name, SIDE)[:N_MESH_LANDMARKS, :2]
    apart = np.linalg.norm(shown.landmarks[:N_MESH_LANDMARKS, :2] - wanted, axis=1)
    eyes = np.linalg.norm(wanted[EYE_OUTER_LEFT] - wanted[EYE_OUTER_RIGHT])
    assert np.median(apart) < 0.06 * eyes
    if name not in DRAWN:  # whose eyes are larger than a person's
        assert shown.eye_distance_px == pytest.approx(eyes, rel=0.15)
    assert shown.n_faces == 1
    assert abs(shown.angles_deg[1]) < 4
    assert not shown.warnings


@pytest.mark.parametrize("yaw", [-20, 20, -35, 35])
def test_a_turned_head_is_told_from_a_straight_one(yaw: float, tracker: FaceTracker) -> None:
    shown = found(still("mara", SIDE, head=(0, yaw, 0)), tracker)
    assert shown.angles_deg[1] == pytest.approx(yaw, abs=6)
    assert [warning for warning in shown.warnings if "turned" in warning] == list(shown.warnings)
    assert len(shown.warnings) == (abs(yaw) > 25)


@pytest.mark.parametrize("name", [*DRAWN, *REALISTIC, "head"])
def test_a_hand_before_the_mouth_is_told(name: str, tracker: FaceTracker) -> None:
    pixels, places = still(name, SIDE), projected(name, SIDE)[:, :2]
    eyes = np.linalg.norm(places[EYE_OUTER_LEFT] - places[EYE_OUTER_RIGHT])
    off = (np.mgrid[:SIDE, :SIDE][::-1].T.swapaxes(0, 1) - places[UPPER_LIP_INNER_MID]) / eyes
    skin = np.median([pixels[round(y), round(x)] for x, y in places[list(CHEEKS)]], axis=0)
    hand = gaussian_filter(np.hypot(off[..., 0] / 0.5, off[..., 1] / 0.33) < 1, 1.0, output=float)[..., None]
    grain = np.random.default_rng(0).normal(0, 2, (SIDE, SIDE, 1))
    covered = np.rint(hand * (skin + grain) + (1 - hand) * pixels).clip(0, 255).astype(np.uint8)
    try:
        said = found(covered, tracker).warnings
    except DataError as refused:  # larger eyes than a person's are read less surely, too
        said = (str(refused),)
    assert [one for one in said if "something may lie before" in one]


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"head": (0, 52, 0)}, r"turned \d\d degrees to the side; give a picture that is turned less than 40"),
        ({"head": (34, 0, 0)}, r"bent \d\d degrees down; give a picture that is bent less than 35"),
        ({"eyeBlinkLeft": 1.0, "eyeBlinkRight": 1.0}, r"eyes of the face in me\.png are closed"),
        ({"side": 80}, r"\d\d pixels wide; it needs 40"),
    ],
)
def test_what_cannot_be_moved_is_told(options: dict, sentence: str, tracker: FaceTracker) -> None:
    with pytest.raises(DataError, match=sentence):
        found(still("mara", **{"side": SIDE, **options}), tracker)


@pytest.mark.parametrize(("least", "turned"), [(0.9, 1.0), (1.0, 0.3)])
def test_what_is_not_surely_a_person_is_refused(
    least: float, turned: float, tracker: FaceTracker, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Faces of animals are found in some crops, and not in others that lie beside these or are turned."""
    read, seen = tracker.read_crop, []

    def read_crop(pixels: np.ndarray, crop: Crop) -> tuple[np.ndarray, float]:
        points, score = read(pixels, crop)
        seen.append(crop)
        return points, min(score, turned if abs(crop.angle - seen[0].angle) > 0.1 else least if len(seen) == 4 else 1.0)

    monkeypatch.setattr(tracker, "read_crop", read_crop)
    with pytest.raises(DataError, match=r"in me\.png is not surely a person's face; animals are not moved"):
        found(still("mara", SIDE), tracker)


def test_pictures_without_a_face_are_told(tracker: FaceTracker) -> None:
    noise = np.random.default_rng(0).integers(0, 255, (300, 200, 3)).astype(np.uint8)
    for pixels in (noise, np.full((200, 300, 3), 90, np.uint8), still("mara", SIDE, head=(0, 85, 0))):
        with pytest.raises(DataError, match=r"there is no face in me\.png; give a picture"):
            found(pixels, tracker)


def test_a_face_that_is_cut_off_is_told(tracker: FaceTracker) -> None:
    with pytest.raises(DataError, match="cut off by the edge of the picture"):
        found(still("mara", SIDE)[:, : round(0.62 * SIDE)], tracker)
    assert not found(
        still("mara", SIDE)[round(0.35 * SIDE) :], tracker
    ).warnings  # a portrait that ends at the forehead


def test_one_of_several_faces_is_chosen_by_its_number(tracker: FaceTracker) -> None:
    both = np.full((SIDE, 2 * SIDE, 3), 120, np.uint8)
    both[:, :SIDE] = still("ada", SIDE)
    both[60:420, SIDE + 60 : 2 * SIDE - 60] = still("ben", 360)
    first = found(both, tracker)
    assert first.landmarks[:, 0].max() < SIDE
    assert [warning for warning in first.warnings if "2 faces, and the largest is used" in warning]
    assert found(both, tracker, number=2).landmarks[:, 0].min() > SIDE
    assert not found(both, tracker, number=2).warnings
    with pytest.raises(InputError, match=r"me\.png has 2 faces, and no face 3; choose 1 to 2"):
        found(both, tracker, number=3)


def test_a_small_face_in_a_large_picture_is_found(tracker: FaceTracker) -> None:
    wide = np.full((1200, 1800, 3), 150, np.uint8)
    wide[700:860, 1500:1660] = still("tomas", 160)
    shown = found(wide, tracker)
    assert 1500 < shown.landmarks[:, 0].mean() < 1660
    assert [warning for warning in shown.warnings if "pixels wide and looks blurred" in warning]
    assert not found(wide, tracker, reduced_by=2.0).warnings  # of a file with twice the pixels
