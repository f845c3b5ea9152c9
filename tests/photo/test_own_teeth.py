"""Teeth of a smile are found between its lips, in the axes of the head, and shown between those of another picture."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from tests.photo.pictures import SMILE, found_in, photographed, projected, still
from tts2face.face.landmarks import landmark_positions, scatter_landmarks
from tts2face.models.face import Face
from tts2face.models.face_loading import load_face
from tts2face.photo.camera import find_camera
from tts2face.photo.lines import find_lip_line
from tts2face.photo.mouth import PICTURED, cheek_light
from tts2face.photo.photograph import Photograph
from tts2face.photo.speaking_photo import speaking_photo
from tts2face.photo.teeth import OwnTeeth, find_teeth
from tts2face.picture.options import Picture
from tts2face.picture.renderer import mesh_renderer

SIDE, NAME = 640, "head"
MARK = np.array([20, 240, 60])  # a colour that no mouth has


@pytest.fixture(scope="module")
def head() -> Face:
    return load_face("head", hair="bald")


@pytest.fixture(scope="module")
def smiling() -> np.ndarray:
    return still(NAME, SIDE, **SMILE)


def teeth_in(pixels: np.ndarray, weights: Mapping[str, float], head: Face) -> OwnTeeth | None:
    found = found_in(NAME, SIDE, **weights)
    camera = find_camera(found, scatter_landmarks(head, landmark_positions(head)))
    return find_teeth(pixels, found, find_lip_line(pixels, found), camera, head)


@pytest.fixture(scope="module")
def teeth(smiling: np.ndarray, head: Face) -> OwnTeeth:
    found = teeth_in(smiling, SMILE, head)
    assert found is not None
    return found


def test_edges_and_colours_are_those_of_the_picture(smiling: np.ndarray, teeth: OwnTeeth, head: Face) -> None:
    part = next(part for part in head.parts if part.name == "teeth_upper")
    lowest = head.vertices[np.unique(head.triangles[part.first : part.first + part.count]), 1].min()
    front = np.abs(teeth.across) < 8
    assert teeth.ends_in_lip
    assert lowest - 0.5 < np.median(teeth.edge[front]) < lowest + 4.0  # mm, some of it behind the lower lip
    assert 28 < np.ptp(teeth.across) < 52
    camera = find_camera(found_in(NAME, SIDE, **SMILE), scatter_landmarks(head, landmark_positions(head)))
    places = np.array([(-4.0, teeth.edge[front].max() + 2.0), (4.0, teeth.edge[front].max() + 2.0)])
    pixels = camera.to_pixels(np.column_stack([places, (25.5, 25.5)]))[:, :2].round().astype(int)
    texels = teeth.texels(*places.T).round().astype(int)
    shown = smiling[pixels[:, 1], pixels[:, 0]].astype(int)
    assert shown.min() > 120  # teeth, not lips or the dark
    np.testing.assert_allclose(teeth.picture[texels[:, 1], texels[:, 0]], shown, atol=20)


@pytest.mark.parametrize(
    "weights",
    [
        {},
        {"jawOpen": 0.6, "mouthFunnel": 0.8},  # the lips hide the upper teeth at the sides
        {"jawOpen": 0.5, "mouthLowerDownLeft": 1.0, "mouthLowerDownRight": 1.0},  # mostly lower teeth
    ],
    ids=["shut", "round", "lower"],
)
def test_no_teeth_are_found_where_too_few_are_seen(weights: dict[str, float], head: Face) -> None:
    assert teeth_in(still(NAME, SIDE, **weights), weights, head) is None


def test_teeth_of_a_grey_picture_are_found(smiling: np.ndarray, teeth: OwnTeeth, head: Face) -> None:
    grey = np.repeat(smiling.mean(axis=2, keepdims=True), 3, axis=2).astype(np.uint8)
    found = teeth_in(grey, SMILE, head)
    assert found is not None
    assert np.ptp(found.across) == pytest.approx(np.ptp(teeth.across), abs=4.0)  # mm


def test_a_darker_picture_gives_the_same_teeth(smiling: np.ndarray, teeth: OwnTeeth, head: Face) -> None:
    dark = (smiling * 0.7).astype(np.uint8)
    found = teeth_in(dark, SMILE, head)
    assert found is not None
    skin = cheek_light(smiling, projected(NAME, SIDE, **SMILE))
    lit = found.in_light_of(skin)
    np.testing.assert_allclose(lit.light, teeth.light, rtol=0.1)
    apart = np.abs(lit.picture.astype(int)[..., :1] - teeth.picture.astype(int)[: len(lit.picture), :, :1])
    assert np.median(apart) < 6
    np.testing.assert_allclose(teeth.in_light_of(teeth.skin).light, teeth.light)


def test_they_are_shown_between_the_lips_of_another_picture(teeth: OwnTeeth, head: Face) -> None:
    seen = photographed(Photograph(still(NAME, SIDE), None, 1.0), found_in(NAME, SIDE))
    picture = np.broadcast_to(MARK, teeth.picture.shape).astype(np.uint8)
    marked = replace(teeth, picture=picture, skin=cheek_light(seen.picture.pixels, seen.found.landmarks))
    face = speaking_photo(seen, head, {"name": "Ada"}, teeth=marked)
    renderer = mesh_renderer(face, Picture())

    def marked_pixels(**weights: float) -> np.ndarray:
        shown = renderer.draw(np.array([weights.get(name, 0.0) for name in face.shape_names], np.float32))
        return (shown[..., 1] > 1.6 * shown[..., 0].astype(int)) & (shown[..., 1] > 60)

    assert not marked_pixels().any()
    wide = marked_pixels(jawOpen=0.5, mouthSmileLeft=0.4, mouthSmileRight=0.4)
    assert wide.sum() > 1.4 * marked_pixels(jawOpen=0.1).sum() > 0
    down, across = np.nonzero(wide)
    assert np.ptp(across) > 3 * np.ptp(down)
    assert face.light.baked.page_of[PICTURED] == 1


def test_teeth_of_the_picture_itself_are_used(smiling: np.ndarray, teeth: OwnTeeth, head: Face) -> None:
    seen = photographed(Photograph(smiling, None, 1.0), found_in(NAME, SIDE, **SMILE), smile=0.9)
    face = speaking_photo(seen, head, {"name": "Ada"})
    part = next(part for part in face.parts if part.name == PICTURED)
    sheet = face.vertices[np.unique(face.triangles[part.first : part.first + part.count])]
    assert np.ptp(sheet[:, 0]) == pytest.approx(np.ptp(teeth.across), abs=0.1)
    others = next(part for part in face.parts if part.name == "teeth_upper")
    beside = face.vertices[face.triangles[others.first : others.first + others.count]][..., 0]
    inside = (beside.min(axis=1) > sheet[:, 0].min()) & (beside.max(axis=1) < sheet[:, 0].max())
    assert not inside.any()
