"""Basis expressions: transferred from a face by an affine map, or captured as pictures, instants and marker stills."""

from pathlib import Path

import numpy as np
import pytest

from corpus_tools.decomposition.basis import basis_from_stills, transfer_basis
from corpus_tools.decomposition.marker_sets import MarkerSet
from corpus_tools.decomposition.markers import read_marker_face
from corpus_tools.decomposition.stills import PictureReader, Still, build_marker_reader, find_stills, parse_stills
from lexicon.errors import DataError, InputError
from tests.corpus_tools.decomposition.made_markers import SIZE, made_take, write_table
from tts2face.face.landmarks import moved_landmarks, rest_landmarks
from tts2face.models.face import Face
from tts2face.models.landmarks import N_LANDMARKS
from tts2face.models.palette import EXPRESSIONS
from tts2face.types import Trajectory

SHOWN = {"sad": "mouthFrownLeft", "happy": "mouthSmileLeft", "afraid": "browInnerUp", "angry": "browDownLeft",
         "surprised": "jawOpen"}  # fmt: skip


def random_faces() -> tuple[np.ndarray, np.ndarray]:
    generator = np.random.default_rng(6)
    return generator.normal(0, 3, (5, N_LANDMARKS, 3)), generator.normal(0, 40, (N_LANDMARKS, 3))


def test_expressions_are_carried_by_the_map_between_faces_at_rest() -> None:
    expressions, rest = random_faces()
    affine = np.diag([0.9, 1.1, 1.2]) + 0.05
    found = transfer_basis(expressions, rest, rest @ affine + [5.0, 60.0, -3.0])
    np.testing.assert_allclose(found.expressions, expressions @ affine, atol=1e-9)


def test_a_face_s_own_expressions_stay() -> None:
    expressions, rest = random_faces()
    np.testing.assert_allclose(transfer_basis(expressions, rest, rest).expressions, expressions, atol=1e-9)


def test_expressions_of_another_number_are_refused() -> None:
    expressions, rest = random_faces()
    with pytest.raises(InputError, match="478 landmarks"):
        transfer_basis(expressions[:4], rest, rest)


def stills_at(folder: Path, suffix: str = ".png") -> dict[str, Still]:
    for name in ("neutral", *EXPRESSIONS):
        (folder / f"{name}{suffix}").write_bytes(b"made")
    return find_stills(folder)


def test_captured_expressions_are_what_differs_from_neutral(tmp_path: Path) -> None:
    expressions, rest = random_faces()
    shown = {"neutral": rest} | {name: rest + move for name, move in zip(EXPRESSIONS, expressions, strict=True)}
    found = basis_from_stills(stills_at(tmp_path), lambda still: shown[still.path.stem])
    np.testing.assert_array_equal(found.rest, rest)
    np.testing.assert_allclose(found.expressions[:, :468], expressions[:, :468], atol=1e-12)
    assert not found.expressions[:, 468:].any()


def test_the_rest_pose_of_a_recording_replaces_a_neutral_still(tmp_path: Path) -> None:
    expressions, rest = random_faces()
    stills = stills_at(tmp_path)
    del stills["neutral"]
    with pytest.raises(InputError, match="no still for neutral"):
        basis_from_stills(stills, lambda still: rest)
    found = basis_from_stills(stills, lambda still: rest + expressions[EXPRESSIONS.index(still.path.stem)], rest=rest)
    np.testing.assert_allclose(found.expressions[:, :468], expressions[:, :468], atol=1e-12)


def test_a_missing_still_is_refused(tmp_path: Path) -> None:
    stills = stills_at(tmp_path)
    del stills["angry"]
    with pytest.raises(InputError, match="no still for angry; a basis takes neutral, sad"):
        basis_from_stills(stills, lambda still: np.zeros((N_LANDMARKS, 3)))


def test_an_expression_like_the_face_at_rest_is_refused(tmp_path: Path) -> None:
    expressions, rest = random_faces()
    shown = {"neutral": rest} | {name: rest + move for name, move in zip(EXPRESSIONS, expressions, strict=True)}
    shown["afraid"] = rest + 0.01
    with pytest.raises(DataError, match=r"afraid\.png shows no afraid expression"):
        basis_from_stills(stills_at(tmp_path), lambda still: shown[still.path.stem])


@pytest.mark.parametrize(
    ("named", "reason"),
    [
        (["bored=a.png"], "'bored=a.png' names no still"),
        (["a.png"], "'a.png' names no still"),
        (["sad=a.png", "sad=a.png"], "two stills for sad"),
        (["sad=b.png"], r"there is no still .*b\.png"),
        (["sad=a.mp4"], r"a\.mp4 is a video; give an instant"),
        (["sad=a.mp4@soon"], "no seconds behind the @"),
        (["sad=a.txt"], "no picture, video or capture"),
    ],
)
def test_a_wrong_still_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, named: list[str], reason: str
) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("a.png", "a.mp4", "a.txt"):
        (tmp_path / name).write_bytes(b"made")
    with pytest.raises(InputError, match=reason):
        parse_stills(named)


def test_two_files_of_one_expression_and_a_folder_that_is_none_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="there is no folder"):
        find_stills(tmp_path / "none")
    stills_at(tmp_path)
    (tmp_path / "sad.jpg").write_bytes(b"made")
    with pytest.raises(InputError, match="two stills for sad"):
        find_stills(tmp_path)


def test_pictures_and_instants_are_read_by_the_tracker(takes: Path, face_model: Path, tmp_path: Path) -> None:
    from PIL import Image

    from tts2face.video.media import read_frames

    film = takes / "clips" / "bbaf2n.mkv"
    pictures = list(read_frames(film))
    path = tmp_path / "sad.png"
    Image.fromarray(pictures[30].pixels).save(path)
    read = PictureReader(face_model)
    instant = read(Still(film, pictures[30].time + 0.01))
    np.testing.assert_array_equal(instant, read(Still(path)))
    eyes = np.linalg.norm(instant[33] - instant[263])
    assert eyes == pytest.approx(88.9, abs=5.0)  # mm of the canonical face
    with pytest.raises(InputError, match=rf"ends at {pictures[-1].time:.2f} s; 7 s is beyond it"):
        read(Still(film, 7.0))
    Image.fromarray(np.full((200, 200, 3), 90, np.uint8)).save(path)
    with pytest.raises(DataError, match=r"sad\.png shows no face"):
        read(Still(path))
    path.write_bytes(b"no picture")
    with pytest.raises(DataError, match=r"cannot read the still .*sad\.png"):
        read(Still(path))


def test_marker_stills_make_a_basis_in_the_person_s_own_size(face: Face, marker_set: MarkerSet, tmp_path: Path) -> None:
    weights = np.zeros((6, len(face.shape_names)))
    for row, shape in enumerate(SHOWN.values(), start=1):
        weights[row, face.shape_names.index(shape)] = 0.8
    shown = moved_landmarks(face, Trajectory(face.shape_names, weights, 30.0))
    take = made_take(shown, np.linspace(0, 0.3, 36).reshape(6, 6), face, marker_set)
    for row, name in enumerate(("neutral", *EXPRESSIONS)):
        write_table(tmp_path / f"{name}.csv", take.names, take.points[row : row + 1].repeat(3, axis=0))
    rest = read_marker_face(tmp_path / "neutral.csv", face, marker_set)
    found = basis_from_stills(find_stills(tmp_path), build_marker_reader(rest))
    landmark_numbers = list(marker_set.landmarks.values())
    expected = (shown[1:] - rest_landmarks(face))[:, landmark_numbers] * SIZE
    assert np.abs(found.expressions[:, landmark_numbers] - expected).max() < 0.2  # mm; axes found from the markers
