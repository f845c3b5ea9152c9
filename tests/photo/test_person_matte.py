"""A person before a door, told from it by a network that knows the answer, in pictures whose layers are known."""

from collections.abc import Sequence

import numpy as np
import pytest

from tests.photo.pictures import found_in
from tts2face.models.face_loading import load_face
from tts2face.photo.matte import part_background, read_person
from tts2face.photo.photograph import Photograph
from tts2face.picture.options import Picture
from tts2face.picture.renderer import draw

SIDE, NAME = 400, "head"
DOOR = (250, 240, 225), (60, 150, 70)  # colours of the wall and of the frame in it
FRAME = slice(96, 112)  # columns of the frame, which the hair hides in part


@pytest.fixture(scope="module")
def person() -> np.ndarray:
    """The shipped head with its coverage (S, S, 4)."""
    return draw(load_face(NAME), picture=Picture(size=f"{SIDE}x{SIDE}", background="transparent"))


@pytest.fixture(scope="module")
def wall() -> np.ndarray:
    made = np.full((SIDE, SIDE, 3), DOOR[0], np.uint8)
    made[:, FRAME] = DOOR[1]
    return made


@pytest.fixture(scope="module")
def picture(person: np.ndarray, wall: np.ndarray) -> Photograph:
    share = person[..., 3:] / 255.0
    return Photograph(np.rint(share * person[..., :3] + (1 - share) * wall).astype(np.uint8), None, 1.0)


class KnownPerson:
    """A network that reads the person from the colours of the wall, with blurred rims, some of them wrong."""

    def __init__(self, off: float = 0.0) -> None:
        self._off, self._count = off, 0

    def __call__(self, values: np.ndarray) -> Sequence[np.ndarray]:
        from scipy.ndimage import gaussian_filter

        first, second = np.array(DOOR) / 255
        way = second - first
        at = ((values[0] - first) @ way / (way @ way)).clip(0, 1)[..., None]
        away = np.linalg.norm(values[0] - first - at * way, axis=2)
        share = gaussian_filter((away > 0.12).astype(np.float32), 3.0)
        self._count += 1
        if self._off and self._count % 2:
            share[: len(share) // 2] = np.maximum(share[: len(share) // 2], self._off)
        return [share[None, ..., None]]


def parted(picture: Photograph, network: KnownPerson) -> Photograph:
    found = found_in(NAME, SIDE)
    return part_background(picture, found.landmarks, found.eye_distance_px, network)


@pytest.fixture(scope="module")
def layers(picture: Photograph) -> Photograph:
    return parted(picture, KnownPerson())


def test_the_coverage_is_that_of_the_person(layers: Photograph, person: np.ndarray) -> None:
    away = np.abs(layers.alpha.astype(float) - person[..., 3]) / 255
    assert away.mean() < 0.015
    mixed = (person[..., 3] > 60) & (person[..., 3] < 200)
    assert away[mixed].mean() < 0.2  # of the network alone: .25
    assert (layers.alpha[person[..., 3] == 0] == 0).mean() > 0.95


def test_both_layers_give_the_picture(layers: Photograph, picture: Photograph) -> None:
    share = layers.alpha[..., None] / 255.0
    apart = np.abs(share * layers.pixels + (1 - share) * layers.behind - picture.pixels).max(axis=2)
    assert np.median(apart) == 0
    assert np.percentile(apart, 98) <= 6


def test_no_colour_of_the_wall_is_left_at_the_rim(layers: Photograph, person: np.ndarray) -> None:
    hair = (person[..., 3] > 100) & (person[..., 3] < 255) & (layers.alpha > 100)
    hair[SIDE // 2 :] = False
    apart = np.abs(layers.pixels[hair].astype(float) - person[hair][:, :3]).mean()
    assert apart < 0.35 * np.abs(np.array(DOOR[0]) - person[hair][:, :3].astype(float)).mean()


def test_the_wall_goes_on_behind_the_person(layers: Photograph, wall: np.ndarray, person: np.ndarray) -> None:
    free = person[..., 3] == 0
    apart = np.abs(layers.behind.astype(int) - wall)
    assert np.percentile(apart[free], 97) <= 2
    hidden = ~free[: SIDE // 2, FRAME]
    assert hidden.sum() > 100
    assert np.median(apart[: SIDE // 2, FRAME][hidden]) <= 10  # the frame goes straight on behind the hair


def test_the_network_is_asked_for_the_parts_around_the_face() -> None:
    """A small person in a large picture is read where the face is, and another one at its edge is background."""
    small = 200
    shown = draw(load_face(NAME), picture=Picture(size=f"{small}x{small}", background="transparent"))
    pixels, alpha = np.full((900, 1500, 3), DOOR[0], np.uint8), np.zeros((900, 1500))
    for top, left in ((500, 900), (650, 60)):
        share = shown[..., 3:] / 255.0
        part = pixels[top : top + small, left : left + small]
        part[:] = np.rint(share * shown[..., :3] + (1 - share) * part)
    alpha[500 : 500 + small, 900 : 900 + small] = shown[..., 3]
    found = found_in(NAME, small)
    places = found.landmarks + np.array([900, 500, 0])
    made = part_background(Photograph(pixels, None, 1.0), places, found.eye_distance_px, KnownPerson())
    assert np.abs(made.alpha - alpha).mean() / 255 < 0.002
    np.testing.assert_array_equal(made.behind[650 : 650 + small, 60 : 60 + small], pixels[650:850, 60:260])


@pytest.mark.parametrize("off", [0.5, 0.8])
def test_readings_that_differ_are_not_used(picture: Photograph, off: float) -> None:
    assert parted(picture, KnownPerson(off)) is picture


@pytest.mark.parametrize("share", [0.0, 1.0])
def test_a_picture_without_a_person_or_without_a_background_stays(picture: Photograph, share: float) -> None:
    found = found_in(NAME, SIDE)
    answer = [np.full((1, 256, 256, 1), share, np.float32)]
    assert part_background(picture, found.landmarks, found.eye_distance_px, lambda _: answer) is picture


def test_colours_decide_where_the_network_is_unsure(picture: Photograph, person: np.ndarray) -> None:
    """Where it reads half a person around the whole head, the colours of hair and wall tell them apart."""

    def unsure(values: np.ndarray) -> Sequence[np.ndarray]:
        from scipy.ndimage import gaussian_filter

        share = gaussian_filter(KnownPerson()(values)[0][0, ..., 0], 4.0)
        return [np.where(share > 0.9, 1, np.where(share > 0.1, 0.5, 0)).astype(np.float32)[None, ..., None]]

    found = found_in(NAME, SIDE)
    read = read_person(picture.pixels, found.landmarks[:, :2], found.eye_distance_px, unsure).share
    own, alone = (np.abs(share - person[..., 3] / 255).mean() for share in (parted(picture, unsure).alpha / 255, read))
    assert own < 0.5 * alone
