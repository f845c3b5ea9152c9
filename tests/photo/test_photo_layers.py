"""A person in a picture and what lies behind, in two layers: cut out, before a wall, and before other backgrounds."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

from lexicon.errors import DataError, InputError
from tests.photo.pictures import ONE_PROCESS, drawn, found_in, speaking
from tts2face.face.deformation import REST_HEAD
from tts2face.models.face import Face
from tts2face.models.face_file import read_face, write_face
from tts2face.models.face_loading import load_face
from tts2face.models.light import Photographed
from tts2face.photo.photograph import Photograph
from tts2face.picture.options import Picture
from tts2face.picture.renderer import MeshRenderer, draw, mesh_renderer

pytestmark = [pytest.mark.usefixtures("drafted"), ONE_PROCESS]

SIDE = 400
NAME = "head"
STRIPES = 7  # of the wall, px
MOST_MOVED_PX = 40  # of a head that turns


@pytest.fixture(scope="module")
def layers() -> Photograph:
    """The shipped head before a striped wall, in two layers."""
    shown = draw(load_face(NAME), picture=Picture(size=f"{SIDE}x{SIDE}", background="transparent"))
    wall = np.full((SIDE, SIDE, 3), 190, np.uint8)
    wall[:, ::STRIPES] = 40
    return replace(Photograph(shown[..., :3].copy(), shown[..., 3].copy(), 1.0).filled(), behind=wall)


@pytest.fixture(scope="module")
def parted(layers: Photograph) -> Face:
    return cut_out(layers)


def cut_out(picture: Photograph, name: str = NAME) -> Face:
    return speaking(picture, found_in(name, SIDE))


@pytest.fixture(scope="module")
def before_wall(parted: Face) -> MeshRenderer:
    return mesh_renderer(parted, Picture())


def test_two_layers_are_the_picture_at_rest(before_wall: MeshRenderer, layers: Photograph) -> None:
    share = layers.alpha[..., None] / 255.0
    wanted = np.rint(share * layers.pixels + (1 - share) * layers.behind)
    apart = np.abs(drawn(before_wall) - wanted).max(axis=2)
    assert np.median(apart) == 0
    assert np.percentile(apart, 99) <= 6


@pytest.mark.parametrize("turn_deg", [(8, 8, 0), (-6, -8, 8), (0, 0, -8)])
def test_lines_beside_a_turned_head_stay_straight(
    before_wall: MeshRenderer, layers: Photograph, turn_deg: tuple[float, ...]
) -> None:
    turned = drawn(before_wall, np.array([*np.radians(turn_deg), 0, 0, 0], np.float32))
    rest = drawn(before_wall)
    away = distance_transform_edt(layers.alpha == 0)
    assert np.abs(turned.astype(int) - rest)[away == 0].mean() > 4
    free = away > MOST_MOVED_PX
    assert free.mean() > 0.3
    np.testing.assert_array_equal(turned[free], layers.behind[free])
    moved = (np.abs(turned.astype(int) - rest).max(axis=2) > 20) & (layers.alpha == 255)
    uncovered = moved & (np.abs(turned.astype(int) - layers.behind).max(axis=2) <= 1)
    assert uncovered.sum() > 30  # the wall is seen where the head was


def test_no_gap_opens_where_shoulders_rise(parted: Face, layers: Photograph) -> None:
    shown = drawn(mesh_renderer(parted, Picture(background="transparent")), breath=1.0)
    np.testing.assert_allclose(shown[-3:, :, 3].astype(int), layers.alpha[-3:], atol=2)
    torso = layers.alpha[:, SIDE // 2] == 255
    assert shown[torso, SIDE // 2, 3].min() >= 253


def test_the_own_background_is_blurred_or_replaced(parted: Face, before_wall: MeshRenderer, layers: Photograph) -> None:
    blurred, white, free = (
        drawn(mesh_renderer(parted, Picture(background=name)), REST_HEAD) for name in ("blur", "white", "transparent")
    )
    wall, person = (distance_transform_edt(layers.alpha == cover) > 3 for cover in (0, 255))
    assert blurred[wall].std() < 0.3 * layers.behind[wall].std()
    assert abs(blurred[wall].mean() - layers.behind[wall].mean()) < 6
    assert (white[wall] == 255).all()
    own = drawn(before_wall).astype(int)
    for shown in (blurred, white, free):
        np.testing.assert_array_equal(shown[person][:, :3], own[person])
    assert np.abs(free[..., 3].astype(int) - layers.alpha).mean() < 1


def test_a_file_keeps_both_layers(parted: Face, before_wall: MeshRenderer, tmp_path: Path) -> None:
    write_face(tmp_path / "me.face", parted)
    kept = mesh_renderer(read_face(tmp_path / "me.face"), Picture())
    assert (tmp_path / "me.face").stat().st_size < 2_500_000
    np.testing.assert_array_equal(kept.scene.face.light.view.alpha, parted.light.view.alpha)
    assert np.abs(drawn(kept).astype(int) - drawn(before_wall)).mean() < 2  # layers are JPEG in files


def test_what_lies_behind_a_photograph_needs_its_coverage(parted: Face, tmp_path: Path) -> None:
    view = replace(parted.light.view, alpha=None)
    write_face(tmp_path / "me.face", replace(parted, light=Photographed(parted.light.baked, view)))
    with pytest.raises(DataError, match="has what lies behind a photograph, but not its alpha"):
        read_face(tmp_path / "me.face")
    view = replace(parted.light.view, behind=parted.light.view.behind[:-2])
    write_face(tmp_path / "me.face", replace(parted, light=Photographed(parted.light.baked, view)))
    with pytest.raises(DataError, match="the photograph and its layers differ in size"):
        read_face(tmp_path / "me.face")


def test_only_photographs_with_a_background_are_blurred(layers: Photograph) -> None:
    cut = cut_out(replace(layers, behind=None))
    with pytest.raises(InputError, match="the photograph has no background that could be blurred"):
        mesh_renderer(cut, Picture(background="blur"))
    with pytest.raises(InputError, match="--background blur is the background of a photograph, and the face is none"):
        mesh_renderer(load_face(NAME), Picture(background="blur"))


def test_a_cut_out_person_moves_before_any_background() -> None:
    shown = draw(load_face(NAME), picture=Picture(size=f"{SIDE}x{SIDE}", background="transparent"))
    cut = cut_out(Photograph(shown[..., :3].copy(), shown[..., 3].copy(), 1.0).filled())
    pose, turned = {"jawOpen": 0.3}, np.array([0, 0.12, 0, 0, 0, 0], np.float32)
    free = drawn(mesh_renderer(cut, Picture(background="transparent")), turned, **pose)
    red = drawn(mesh_renderer(cut, Picture(background="#ff0000")), turned, **pose)
    assert free.shape == (SIDE, SIDE, 4)
    assert abs(free[..., 3].mean() - shown[..., 3].mean()) < 4
    alpha = free[..., 3:] / 255.0
    mixed = alpha * free[..., :3] + (1 - alpha) * np.array([255, 0, 0])
    assert np.abs(mixed - red).mean() < 0.5
    np.testing.assert_array_equal(red[:20, :20], np.full((20, 20, 3), (255, 0, 0)))


def test_large_eyes_do_not_show_beside_the_cheeks() -> None:
    shown = draw(load_face("zuri"), picture=Picture(size=f"{SIDE}x{SIDE}", background="transparent"))
    cut = cut_out(Photograph(shown[..., :3].copy(), shown[..., 3].copy(), 1.0).filled(), "zuri")
    free = drawn(mesh_renderer(cut, Picture(background="transparent")))
    assert np.abs(free[..., 3].astype(int) - shown[..., 3]).max() < 64
