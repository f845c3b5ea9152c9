"""Faces with baked light: how they are drawn, and their files."""

from dataclasses import replace

import numpy as np
import pytest

from lexicon.errors import DataError
from tests.picture.film.lit_face import (
    CAMERA_CHANGE,
    MOST_CHANGE,
    RISE_CHANGE,
    SKIN_LIGHT,
    TONGUE_LIGHT,
    TURN_CHANGE,
    WALL,
    lit_tiny_face,
)
from tts2face.face.deformation import REST_HEAD
from tts2face.face.pupils import DILATION, PUPIL_SHAPE
from tts2face.models.face import Texture, keep_parts
from tts2face.models.face_file import read_face, write_face
from tts2face.models.light import Baked, Lamps
from tts2face.picture.baked.eyes import EDGE_RAD
from tts2face.picture.baked.scene import LitScene
from tts2face.picture.options import Picture
from tts2face.picture.renderer import mesh_renderer
from tts2face.picture.scene import Scene

FACE = lit_tiny_face()
REST = np.zeros(len(FACE.shape_names), np.float32)
SIZE = "96x96"


def drawn(face=FACE, weights=REST, head=REST_HEAD, **options):
    renderer = mesh_renderer(face, Picture(**{"size": SIZE} | options))
    assert isinstance(renderer.scene, LitScene)
    return renderer.draw(weights, head).astype(int)


def pose(**weights):
    return np.array([weights.get(name, 0.0) for name in FACE.shape_names], np.float32)


def forehead(picture):
    return picture[25:35, 42:54, :3].reshape(-1, 3).mean(axis=0)


def test_a_face_at_rest_has_its_baked_colours_before_its_wall() -> None:
    picture = drawn()
    assert forehead(picture) == pytest.approx(SKIN_LIGHT, abs=1)
    assert picture[2, 2] == pytest.approx(WALL, abs=2)
    assert drawn(background="#ff0000")[2, 2].tolist() == [255, 0, 0]
    clear = drawn(background="transparent")
    assert clear[2, 2, 3] == 0
    assert clear[30, 48, 3] == 255
    opened = drawn(weights=pose(jawOpen=1.0)).reshape(-1, 3)
    assert (np.abs(opened - TONGUE_LIGHT).max(axis=1) <= 1).sum() > 10


def test_light_changes_with_expression_head_and_camera() -> None:
    raised = (drawn(weights=pose(mouthSmileLeft=0.8)).reshape(-1, 3) - SKIN_LIGHT)[:, 0]
    assert (np.abs(raised - RISE_CHANGE) <= 1).sum() > 100  # by 8 mm
    opened = (drawn(weights=pose(jawOpen=1.0)).reshape(-1, 3) - SKIN_LIGHT)[:, 0]  # by more than was baked
    assert (np.abs(opened + MOST_CHANGE) <= 1).sum() > 100
    turned = np.radians([0, 20, 0, 0, 0, 0]).astype(np.float32)
    assert forehead(drawn(head=turned)) - SKIN_LIGHT == pytest.approx([0, TURN_CHANGE, 0], abs=1)
    lashes = [drawn(camera=camera, supersampling=3).reshape(-1, 3) for camera in ("front", "30,0")]
    dark = [picture[picture.max(axis=1) < 90] for picture in lashes]
    assert np.median(dark[0], axis=0) == pytest.approx([30, 30, 30], abs=2)
    assert np.median(dark[1], axis=0) == pytest.approx([30, 30, 30 + CAMERA_CHANGE], abs=2)
    light = FACE.light.baked
    both = replace(light, camera_modes=np.concatenate([light.camera_modes, 0 * light.camera_modes], axis=2))
    seen = drawn(replace(FACE, light=Baked(both)), camera="30,0").reshape(-1, 3)
    off = np.abs(seen - SKIN_LIGHT - [0, 0, CAMERA_CHANGE]).max(axis=1)
    assert (off <= 1).sum() > 1000  # the skin, when the first page has the change


def test_shapes_that_a_palette_adds_move_the_face_in_the_light_of_its_own() -> None:
    pushed = np.zeros_like(FACE.vertices)
    pushed[:, 0] = 30.0
    more = replace(
        FACE,
        shape_names=(*FACE.shape_names, "added"),
        shapes=np.concatenate([FACE.shapes, pushed[None]]),
        limits=np.concatenate([FACE.limits, FACE.limits[:1]]),
    )
    moved = drawn(more, np.append(pose(jawOpen=0.5), np.float32(1.0)))
    still = drawn(weights=pose(jawOpen=0.5))
    assert forehead(moved) == pytest.approx(forehead(still), abs=1)
    assert np.abs(moved - still).mean() > 5


@pytest.mark.parametrize(
    "options", [{"supersampling": 1}, {"supersampling": 3}, {"quality": "high"}, {"size": "600x40"}]
)
def test_pictures_of_any_quality_and_size_show_the_same_face(options: dict[str, object]) -> None:
    picture = Picture(**{"size": SIZE} | options)  # type: ignore[arg-type]
    pixels = mesh_renderer(FACE, picture).draw(REST)
    assert pixels.shape == (picture.height, picture.width, 3)
    share = (np.abs(pixels.astype(int) - SKIN_LIGHT).max(axis=2) <= 1).sum() / picture.height**2
    usual = (np.abs(drawn() - SKIN_LIGHT).max(axis=2) <= 1).mean()
    assert share == pytest.approx(usual, rel=0.1)


def test_eyes_are_looked_up_in_the_view_transform() -> None:
    eyes = drawn()[40:50, 62:74]
    expected = 255 * np.log(0.5 / 0.004 + 1) / np.log(4001)
    assert (np.abs(eyes - expected).max(axis=2) < 3).any()


def test_a_pupil_widens_within_its_iris() -> None:
    side, (pupil, iris) = 256, FACE.light.baked.eye_edges
    across = (np.arange(side) + 0.5) / side * 2 - 1
    off = EDGE_RAD * np.hypot(across[:, None], across)
    painted = np.where(off[..., None] < pupil, (255, 0, 0), np.where(off[..., None] < iris, (0, 255, 0), (0, 0, 255)))
    face = replace(
        FACE,
        parts=tuple(replace(part, name="iris", texture=1) if "eye" in part.name else part for part in FACE.parts),
        textures=(*FACE.textures, Texture(painted.astype(np.uint8))),
        shape_names=tuple(PUPIL_SHAPE if name == "mouthSmileLeft" else name for name in FACE.shape_names),
        shapes=FACE.shapes * (np.array(FACE.shape_names) != "mouthSmileLeft")[:, None, None],
    )
    areas = []
    for weight in (-1.0, 0.0, 1.0):
        weights = pose(mouthSmileLeft=weight)
        shown = np.sort(picture := drawn(face, weights, size="400x400"), axis=2)
        pure = (shown[..., 2] > 100) & (shown[..., 1] < 30)
        areas.append([(pure & (picture.argmax(axis=2) == colour)).sum() for colour in range(3)])
    small, usual, wide = np.array(areas, float)
    assert wide[0] / usual[0] == pytest.approx((1 + DILATION) ** 2, rel=0.1)
    assert small[0] / usual[0] == pytest.approx((1 - DILATION) ** 2, rel=0.1)
    assert wide[:2].sum() == pytest.approx(usual[:2].sum(), rel=0.02)  # the iris stays


def test_light_is_the_same_after_it_was_written(tmp_path) -> None:
    path = tmp_path / "lit.face"
    write_face(path, FACE)
    read = read_face(path)
    old, new = FACE.light.baked, read.light.baked
    for name in (
        "triangles",
        "rows",
        "responses",
        "limits",
        "partners",
        "mouth_base",
        "mouth_responses",
        "turn_modes",
        "camera_sizes",
        "ball_base",
        "view",
    ):
        assert np.array_equal(getattr(old, name), getattr(new, name)), name
    assert new.page_of == old.page_of
    assert np.abs(drawn(read) - drawn()).max() <= 4  # JPEG
    again = tmp_path / "again.face"
    write_face(again, read)
    assert read_face(again).light.baked.lamps.shape == old.lamps.shape


@pytest.mark.parametrize(
    ("changes", "what"),
    [
        ({"rows": FACE.light.baked.rows + 10_000}, "rows holds"),
        ({"triangles": FACE.light.baked.triangles + 10_000}, "draws a triangle"),
        ({"base": FACE.light.baked.base[1:]}, "base has the shape"),
        ({"response_sizes": FACE.light.baked.response_sizes[1:]}, "response_sizes has the shape"),
        ({"partners": FACE.light.baked.partners[1:]}, "partners has the shape"),
        ({"sky": np.full(3, np.nan, np.float32)}, "sky holds nan"),
        ({"pages": np.zeros((2, 48, 48, 3), np.uint8)}, "a side that is not a power of two"),
        ({"turn_modes": np.zeros((1, 3, 50), np.int8)}, "do not fill"),
        ({"head_lamps": 2}, "has 2 head_lamps, but 0 lamps"),
        ({"page_of": {"skin": 2}}, "page_of"),
    ],
)
def test_light_that_does_not_fit_its_face_is_refused(tmp_path, changes, what: str) -> None:
    path = tmp_path / "bad.face"
    write_face(path, replace(FACE, light=Baked(replace(FACE.light.baked, **changes))))
    with pytest.raises(DataError, match=what) as refused:
        read_face(path)
    assert "bad.face" in str(refused.value)


def test_a_face_without_some_of_its_parts_is_drawn_with_lamps() -> None:
    bare = keep_parts(FACE, lambda part: part.name != "lashes")
    assert bare.light == Lamps()
    assert isinstance(mesh_renderer(bare, Picture(size=SIZE)).scene, Scene)


def test_a_face_with_light_needs_the_landmarks_of_its_mouth(tmp_path) -> None:
    path = tmp_path / "bad.face"
    lacking = replace(
        FACE,
        landmarks=FACE.landmarks[1:],
        landmark_vertices=FACE.landmark_vertices[1:],
        landmark_weights=FACE.landmark_weights[1:],
    )
    write_face(path, lacking)
    with pytest.raises(DataError, match="not the landmark 78"):
        read_face(path)
