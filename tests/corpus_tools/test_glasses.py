"""Glasses on skin are found, taken off and worn."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from corpus_tools.dense.glasses import Glasses, covered_skin, find_glasses, wear_glasses
from corpus_tools.dense.mesh_fit import face_landmarks, part_vertices
from corpus_tools.dense.texture import without_covered
from lexicon.errors import DataError
from tts2face.models.face import Face
from tts2face.models.face_file import read_face, write_face
from tts2face.models.face_loading import load_face
from tts2face.models.hair import attach_hair
from tts2face.models.hair_file import load_hair
from tts2face.models.landmarks import LID_RINGS, N_MESH_LANDMARKS
from tts2face.storage.shipped import find_file

SKIN, FRAME = np.array([205.0, 150.0, 125.0]), np.array([60.0, 40.0, 30.0])


@pytest.fixture(scope="module")
def head() -> Face:
    return read_face(find_file("head", "face"))


@pytest.fixture(scope="module")
def marks(head: Face) -> np.ndarray:
    return face_landmarks(head, head.vertices.astype(np.float64))[:N_MESH_LANDMARKS]


def painted(
    marks: np.ndarray, size: tuple[float, float] | None, wire: float, light: float
) -> tuple[np.ndarray, np.ndarray]:
    """Places and colours of noisy skin in front, shaded beside the nose, with glasses of half sizes of rims or none."""
    x, y = (grid.ravel() for grid in np.meshgrid(np.arange(-70, 70.1, 0.5), np.arange(-50, 40.1, 0.5)))
    colours = SKIN * light * (1 - 0.25 * np.exp(-(((np.abs(x) - 14) / 6) ** 2)))[:, None]
    if size is not None:
        dark = np.zeros(len(x), bool)
        for ring in LID_RINGS:
            middle = marks[list(ring), :2].mean(axis=0)
            off = np.hypot((x - middle[0]) / size[0], (y - middle[1]) / size[1])
            dark |= np.abs(off - 1) * min(size) < wire
        inner = 33.0 - size[0]
        dark |= (np.abs(x) < inner + 1) & (np.abs(y - 3) < wire)
        colours[dark] = FRAME * light
    noise = np.random.default_rng(1).normal(0, 3, colours.shape)
    return np.column_stack([x, y]), np.clip(colours + noise, 0, 255)


@pytest.mark.parametrize("light", [1.0, 0.4])
@pytest.mark.parametrize(("size", "wire"), [((21.0, 17.0), 1.0), ((25.0, 21.0), 1.8)])
def test_glasses_are_found_by_their_size_and_colour(
    marks: np.ndarray, size: tuple[float, float], wire: float, light: float
) -> None:
    places, colours = painted(marks, size, wire, light)
    found = find_glasses(places, colours, marks)
    assert found is not None
    half = np.ptp(found.rims, axis=1).mean(axis=0) / 2
    np.testing.assert_allclose(half, size, atol=2.5)
    assert np.abs(found.colour - FRAME * light).max() < 45
    is_frame = colours.sum(axis=1) < 0.6 * light * SKIN.sum()
    covered = covered_skin(found, places)
    assert covered[is_frame].mean() > 0.95
    assert covered.mean() < 0.35


@pytest.mark.parametrize("light", [1.0, 0.4])
def test_a_plain_face_has_no_glasses(marks: np.ndarray, light: float) -> None:
    assert find_glasses(*painted(marks, None, 1.0, light), marks) is None


def test_covered_skin_is_that_around_it() -> None:
    colour = np.tile(SKIN, (50, 1))
    colour[20:25] = FRAME
    is_covered = np.arange(50) // 5 == 4

    def blurred(values: np.ndarray, spread: float) -> np.ndarray:
        return np.tile(values.mean(axis=0), (len(values), 1))

    found = without_covered(colour, is_covered, blurred)
    np.testing.assert_allclose(found, np.tile(SKIN, (50, 1)), atol=1e-6)


def round_glasses() -> Glasses:
    turn = np.linspace(0, 2 * np.pi, 64, endpoint=False)
    rim = np.column_stack([24 * np.cos(turn), 19 * np.sin(turn)])
    return Glasses(rim + np.array([[[-31.0, 0.0]], [[31.0, 0.0]]]), np.zeros((1, 2)), FRAME)


def test_a_head_with_glasses_takes_haircuts_and_moves(head: Face, tmp_path: Path) -> None:
    worn = wear_glasses(head, round_glasses())
    assert worn.parts[-1].name == "glasses"
    points = worn.vertices[len(head.vertices) :]
    rim = points[points[:, 2] > 15]
    assert np.ptp(rim[:, 0]) > 90
    assert (rim[:, 2] > head.vertices[: len(head.vertices), 2].max() - 45).all()
    assert not worn.shapes[:, len(head.vertices) :].any()
    write_face(tmp_path / "worn.face", worn)
    for hair in ("bob02", "bald"):
        dressed = load_face(str(tmp_path / "worn.face"), hair=hair)
        assert [part.name for part in dressed.parts].count("glasses") == 1
        assert len(dressed.vertices) >= len(worn.vertices)


def test_other_faces_with_more_vertices_take_no_haircut(head: Face) -> None:
    worn = wear_glasses(head, round_glasses())
    other = replace(worn, parts=(*worn.parts[:-1], replace(worn.parts[-1], name="hat")))
    with pytest.raises(DataError, match="fits heads of"):
        attach_hair(other, load_hair("bob02"), "brown")


def test_wires_lie_before_the_skin_of_round_cheeks(head: Face) -> None:
    turn = np.linspace(0, 2 * np.pi, 64, endpoint=False)
    half = np.array([24.0, 22.0])
    rims = np.array([eye.centre[:2] + half * np.column_stack([np.cos(turn), np.sin(turn)]) for eye in head.eyes])
    worn = wear_glasses(head, Glasses(rims, np.zeros((0, 2)), FRAME))
    points = worn.vertices[len(head.vertices) :].astype(float)
    ahead = points[(np.abs(points[:, 0]) < 45) & (points[:, 2] > points[:, 2].max() - 25)]
    skin = head.vertices[part_vertices(head, ("skin",))].astype(float)
    skin = skin[skin[:, 2] > ahead[:, 2].min() - 15]
    under = skin[cKDTree(skin[:, :2]).query(ahead[:, :2])[1], 2]
    assert (ahead[:, 2] > under).all()
