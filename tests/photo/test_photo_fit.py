"""Corrections of a photo by a person: what is given is used, the rest stays as found, wrong files are refused."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lexicon.errors import DataError, InputError
from tests.photo.pictures import ONE_PROCESS, found_in, photographed, still
from tts2face.face.landmarks import landmark_positions
from tts2face.models.face import Face
from tts2face.models.face_loading import load_face
from tts2face.models.landmarks import INNER_LIP_UPPER, LEFT_LIDS, LOWER_LIP_INNER_MID, RIGHT_LIDS, UPPER_LIP_INNER_MID
from tts2face.models.light import Photographed
from tts2face.photo.fit import NOTHING_GIVEN, PhotoFit, parse_fit, read_fit, write_fit
from tts2face.photo.photograph import Photograph
from tts2face.photo.speaking_photo import speaking_photo

pytestmark = ONE_PROCESS

SIDE, NAME, REDUCED_BY = 400, "head", 2.0
SHIFT = np.array([0.0, 6.0])  # pixels of the file, three of the picture
LINE = [[300, 500], [400, 520], [500, 500]]
EYE = [[250, 300], [300, 280], [350, 300]]


def face_with(fit: PhotoFit, **weights: float) -> Face:
    picture = Photograph(still(NAME, SIDE, **weights), None, REDUCED_BY)
    metadata = {"name": "Ada", "consent": {"statement": "drawn"}}
    seen = photographed(picture, found_in(NAME, SIDE, **weights))
    return speaking_photo(seen, load_face("head", hair="bald"), metadata, fit=fit)


@pytest.fixture(scope="module")
def face() -> Face:
    return face_with(NOTHING_GIVEN)


@pytest.fixture
def found(face: Face) -> dict[str, Any]:
    """What was found, as an object of JSON."""
    content: dict[str, Any] = json.loads(json.dumps(face.metadata["fit"]))
    return content


def in_picture(face: Face, points: np.ndarray) -> np.ndarray:
    """Places (N, 2) in the file of points (N, 3), mm."""
    assert isinstance(face.light, Photographed)
    view, lens = face.light.view.view, face.light.view.lens
    seen = points @ view[:, :3].T + view[:, 3]
    return (seen[:, :2] / seen[:, 2:] * lens[0] + lens[1:] + 0.5) * REDUCED_BY


def landmarks_of(face: Face) -> np.ndarray:
    return in_picture(face, landmark_positions(face))


def test_what_was_found_gives_the_same_face_and_survives_a_file(face: Face, tmp_path: Path) -> None:
    path = tmp_path / "found.json"
    write_fit(path, face.metadata["fit"])
    assert len(path.read_text().splitlines()) == len(face.metadata["fit"]) + 2
    again = face_with(read_fit(path))
    assert np.abs(landmarks_of(again) - landmarks_of(face)).max() < 1.0  # pixels of the file
    assert again.metadata["fit"].keys() == face.metadata["fit"].keys()


def test_places_of_the_file_are_those_of_the_face(face: Face, found: dict[str, Any]) -> None:
    places = landmarks_of(face)
    seam = np.array(found["lips"]["seam"])
    np.testing.assert_allclose(seam, places[list(INNER_LIP_UPPER)], atol=0.6)
    np.testing.assert_allclose(found["right_eye"]["upper"], places[list(RIGHT_LIDS[0])], atol=0.6)
    np.testing.assert_allclose(found["left_eye"]["lower"], places[list(LEFT_LIDS[1])][::-1], atol=0.6)
    np.testing.assert_allclose(found["pivot"], in_picture(face, face.pivot[None])[0], atol=0.1)
    assert np.diff(found["left_eye"]["upper"], axis=0)[:, 0].min() > 0


def test_given_places_replace_what_was_found(face: Face, found: dict[str, Any]) -> None:
    seam = np.array(found["lips"]["seam"]) + SHIFT
    moved = face_with(parse_fit({"lips": {"seam": seam.tolist()}}))
    ways = landmarks_of(moved) - landmarks_of(face)
    np.testing.assert_allclose(ways[list(INNER_LIP_UPPER)], np.tile(SHIFT, (len(INNER_LIP_UPPER), 1)), atol=0.6)
    np.testing.assert_allclose(ways[list(RIGHT_LIDS[0])], 0, atol=0.2)
    pivot = np.array(found["pivot"]) + SHIFT
    turned = face_with(parse_fit({"pivot": pivot.tolist()}))
    np.testing.assert_allclose(in_picture(turned, turned.pivot[None])[0], pivot, atol=0.2)
    assert np.linalg.norm(turned.pivot - face.pivot) > 0.5


def test_teeth_lie_where_their_edge_is_given(face: Face, found: dict[str, Any]) -> None:
    teeth = np.array(found["teeth"])
    moved = face_with(parse_fit({"teeth": (teeth + SHIFT).tolist()}))
    (part,) = (part for part in face.parts if part.name == "teeth_upper")
    rows = np.unique(face.triangles[part.first : part.first + part.count])
    before, after = (in_picture(one, one.vertices[rows].astype(float)) for one in (face, moved))
    edge = before[np.abs(before[:, 0] - teeth[0]) < 6][:, 1].max()
    assert edge == pytest.approx(teeth[1], abs=2.0)
    np.testing.assert_allclose((after - before).mean(axis=0), SHIFT, atol=0.3)


def test_a_lid_takes_the_corners_of_the_one_that_is_given(face: Face, found: dict[str, Any]) -> None:
    upper = np.array(found["right_eye"]["upper"])
    upper[0] -= (5.0, 0.0)
    moved = landmarks_of(face_with(parse_fit({"right_eye": {"upper": upper[::2].tolist()}})))
    outer = RIGHT_LIDS[0][0]
    assert RIGHT_LIDS[1][0] == outer
    np.testing.assert_allclose(moved[outer], upper[0], atol=0.2)
    np.testing.assert_allclose(moved[RIGHT_LIDS[1][4]], landmarks_of(face)[RIGHT_LIDS[1][4]], atol=3.0)


def test_lips_are_parted_and_closed_by_a_person(face: Face, found: dict[str, Any]) -> None:
    seam = np.array(found["lips"]["seam"])
    bow = np.sin(np.linspace(0, np.pi, len(seam)))[:, None] * (0.0, 20.0)
    parted = face_with(parse_fit({"lips": {"upper": seam.tolist(), "lower": (seam + bow).tolist()}}))
    assert set(parted.metadata["fit"]["lips"]) == {"upper", "lower"}
    rest = landmarks_of(parted)
    np.testing.assert_allclose(rest[UPPER_LIP_INNER_MID], rest[LOWER_LIP_INNER_MID], atol=0.1)  # shut at rest
    assert parted.metadata["fit"]["teeth"][1] > face.metadata["fit"]["teeth"][1]  # behind the lip, which meets lower
    opened = face_with(parse_fit({"lips": {"seam": seam.tolist()}}), jawOpen=0.4)
    assert set(opened.metadata["fit"]["lips"]) == {"seam"}


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ([], "give an object in curly brackets"),
        ({"lip": {}}, "there is no 'lip' here; choose lips, right_eye, left_eye, teeth, pivot"),
        ({"right_eye": {"seam": LINE}}, "there is no 'seam' here; choose upper, lower"),
        ({"lips": {"seam": LINE[:2]}}, "lips.seam has 2 points; give 3 to 200"),
        ({"lips": {"seam": LINE[::-1]}}, "lips.seam must go from the left of the picture to its right"),
        ({"lips": {"seam": [LINE[1], LINE[0], LINE[2]]}}, "lips.seam must go from the left"),
        ({"lips": {"seam": [1, 2, 3]}}, r"lips: seam\[0\] must be a list in square brackets, not 1"),
        ({"lips": {"seam": [[1, 2, 3]] * 3}}, r"lips: seam\[0\] must be \[x, y\] in pixels, not \[1, 2, 3\]"),
        ({"teeth": ["a", 3]}, r'teeth\[0\] must be a number, not "a"'),
        ({"lips": {"seam": LINE, "upper": LINE}}, "lips has a seam and parted edges"),
        ({"left_eye": {"upper": EYE, "lower": LINE}}, "must begin and end at the same points"),
    ],
)
def test_other_files_are_refused(content: object, reason: str, tmp_path: Path) -> None:
    path = tmp_path / "fit.json"
    path.write_text(json.dumps(content))
    with pytest.raises(DataError, match=reason) as refused:
        read_fit(path)
    assert str(refused.value).startswith((f"{path}: ", f"{path}, "))


def test_a_missing_file_is_an_error_of_the_user(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot read the fit"):
        read_fit(tmp_path / "no.json")


def test_places_that_cannot_be_in_the_picture_are_refused(found: dict[str, Any]) -> None:
    outside, far = np.array(found["lips"]["seam"]), np.array(found["lips"]["seam"])
    outside[-1, 0] = 2 * SIDE * REDUCED_BY
    far[:, 1] -= 300
    upper, lower = (np.array(found["right_eye"][edge]) for edge in ("upper", "lower"))
    crossed = np.concatenate([upper[:1], lower[1:-1] + np.array([0, 10]), upper[-1:]])
    shut = np.concatenate([upper[:1], lower[1:-1], upper[-1:]])
    for content, reason in (
        ({"lips": {"seam": outside}}, "of lips.seam lies outside the picture, which has 800 x 800 pixels"),
        ({"lips": {"seam": far}}, "lips.seam lies 300 pixels from the face that was found"),
        ({"right_eye": {"upper": crossed}}, "the upper and the lower line of right_eye cross near"),
        ({"right_eye": {"upper": shut}}, "the lids of right_eye are shut"),
        ({"pivot": np.array([9e5, 0])}, r"the point \[900000, 0\] of pivot lies outside the picture"),
    ):
        plain = {
            part: {edge: line.tolist() for edge, line in value.items()} if isinstance(value, dict) else value.tolist()
            for part, value in content.items()
        }  # fmt: skip
        with pytest.raises(DataError, match=reason):
            face_with(parse_fit(plain))
