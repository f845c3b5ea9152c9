"""The drawn characters as they are built: where the data of MakeHuman are at hand."""

import numpy as np
import pytest

from corpus_tools.shipped.drawn.build_drawn import BODY_SHAPES, CAST, drawn_face
from tests.interchange.characters.makehuman import makehuman
from tts2face.face.breathing import BREATH_SHAPE
from tts2face.face.landmarks import landmark_motion, landmark_positions
from tts2face.models.face import Face
from tts2face.models.face_loading import load_face
from tts2face.models.landmarks import INNER_LIP_LOWER, INNER_LIP_UPPER, LOWER_LIP_INNER_MID, UPPER_LIP_INNER_MID

UPPER_LID, LOWER_LID = 386, 374  # landmarks in the middle of the left eye's lids


@pytest.fixture(scope="module", params=list(CAST))
def face(request: pytest.FixtureRequest) -> Face:
    return drawn_face(makehuman(), CAST[request.param])


def places(face: Face, **weights: float) -> dict[int, np.ndarray]:
    """Landmarks (3,) in mm by number, in a pose."""
    shapes = np.array([face.shape_names.index(name) for name in weights], np.int64)
    moved = landmark_positions(face) + landmark_motion(face, shapes) @ np.array(list(weights.values()))
    return dict(zip(face.landmarks.tolist(), moved, strict=True))


def test_the_skin_has_the_layout_of_the_shipped_head(face: Face) -> None:
    head = load_face("head", hair="bald")
    skins = [one.triangles[: one.parts[0].count] for one in (face, head)]
    assert np.array_equal(*skins)
    used = np.unique(skins[0])
    np.testing.assert_allclose(face.uv[used], head.uv[used], atol=1e-4)  # files round it
    assert face.shape_names == (*head.shape_names, *BODY_SHAPES)
    assert face.landmarks.tolist() == head.landmarks.tolist()
    assert np.isfinite(face.shapes).all()


def test_lips_touch_at_rest_and_part_with_the_jaw(face: Face) -> None:
    rest, opened = places(face), places(face, jawOpen=0.6)
    for above, below in zip(INNER_LIP_UPPER, INNER_LIP_LOWER, strict=True):
        assert abs(rest[above][1] - rest[below][1]) < 1.0
    assert opened[UPPER_LIP_INNER_MID][1] - opened[LOWER_LIP_INNER_MID][1] > 8.0


def test_lids_shut(face: Face) -> None:
    rest, shut = places(face), places(face, eyeBlinkLeft=1.0)
    assert rest[UPPER_LID][1] - rest[LOWER_LID][1] > 15.0
    assert shut[UPPER_LID][1] - shut[LOWER_LID][1] < 0.5


def test_shoulders_rise_three_millimetres_and_the_head_stays(face: Face) -> None:
    moved = face.shapes[face.shape_names.index(BREATH_SHAPE)]
    height = face.vertices[:, 1]
    assert np.abs(moved[height > -100]).max() == 0
    assert 2.0 <= moved[height < -160, 1].mean() <= 4.0
