"""Eyes of a picture: catchlights stay nearly where the lamp is, while the iris moves under them."""

from functools import cache

import numpy as np
import pytest

from tests.photo.pictures import found_in, speaking, still
from tts2face.models.face import Face
from tts2face.photo.eyes import IRISES
from tts2face.photo.found_face import FoundFace
from tts2face.photo.photograph import Photograph
from tts2face.photo.surface import EYES
from tts2face.picture.options import Picture
from tts2face.picture.renderer import MeshRenderer, mesh_renderer

SIDE, NAME = 800, "head"
ASIDE = {"eyeLookOutLeft": 0.8, "eyeLookInRight": 0.8}  # to the right in the picture
IRIS, PUPIL, SPOT = (90, 110, 60), (15, 12, 10), (250, 250, 250)
BRIGHT = 215  # of 255, as no white of these eyes is
SPOT_AT, SPOT_RADIUS, PUPIL_RADIUS = np.array([-0.3, -0.2]), 0.14, 0.35  # of the iris's radius


def painted(found: FoundFace, eyes: tuple[int, ...]) -> tuple[np.ndarray, list[np.ndarray], float]:
    """A picture with plain irises, of which some have a catchlight, their middles and their radius."""
    pixels = still(NAME, SIDE).copy()
    down, across = np.mgrid[:SIDE, :SIDE]
    middles = [found.landmarks[iris[0], :2] for iris in IRISES]
    rims = found.landmarks[list(IRISES[0][1:]), :2]
    radius = float(np.linalg.norm(rims - middles[0], axis=1).mean())
    for eye, middle in enumerate(middles):
        opening = np.abs(down - middle[1]) < 0.6 * radius  # not the lids
        for offset, share, colour in ((0, 1.0, IRIS), (0, PUPIL_RADIUS, PUPIL), (SPOT_AT, SPOT_RADIUS, SPOT)):
            at = middle + np.asarray(offset) * radius
            if colour is not SPOT or eye in eyes:
                pixels[(np.hypot(across - at[0], down - at[1]) < share * radius) & opening] = colour
    return pixels, middles, radius


@cache
def renderer_of(face: Face) -> MeshRenderer:
    return mesh_renderer(face, Picture())


def spots(face: Face, middles: list[np.ndarray], radius: float, **weights: float) -> np.ndarray:
    """Places (2, 2) of the bright spot in each eye; NaN where there is none."""
    weighted = np.array([weights.get(name, 0.0) for name in face.shape_names], np.float32)
    grey = renderer_of(face).draw(weighted).astype(float).mean(axis=2)
    found = np.full((2, 2), np.nan)
    for eye, middle in enumerate(middles):
        x, y = (middle - radius).round().astype(int)
        bright = np.argwhere(grey[y : y + round(2 * radius), x : x + round(2.2 * radius)] > BRIGHT)
        if len(bright):
            found[eye] = bright.mean(axis=0)[::-1]
    return found


@pytest.fixture(scope="module")
def found() -> FoundFace:
    return found_in(NAME, SIDE)


def test_catchlights_follow_the_iris_in_part_where_both_eyes_have_some(found: FoundFace) -> None:
    ways = []
    for eyes, n_patches in (((0, 1), 4), ((0,), 2)):
        pixels, middles, radius = painted(found, eyes)
        face = speaking(Photograph(pixels, None, 1.0), found)
        assert [part.name for part in face.parts].count(EYES) == n_patches
        ways.append(spots(face, middles, radius, **ASIDE) - spots(face, middles, radius))
    (staying, other), (following, none) = ways
    assert following[0] > 0.4 * radius
    assert staying[0] / following[0] == pytest.approx(0.45, abs=0.1)  # spots are four pixels wide
    assert other[0] == pytest.approx(staying[0], abs=1.0)
    assert np.isnan(none).all()


def test_at_rest_they_are_those_of_the_picture(found: FoundFace) -> None:
    pixels, middles, _ = painted(found, (0, 1))
    face = speaking(Photograph(pixels, None, 1.0), found)
    shown = renderer_of(face).draw(np.zeros(len(face.shape_names), np.float32))
    for middle in middles:
        x, y = middle.round().astype(int)
        part = np.s_[y - 5 : y + 6, x - 8 : x + 9]
        assert np.abs(shown[part].astype(int) - pixels[part]).mean() < 4
