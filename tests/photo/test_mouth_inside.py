"""What lies behind lips has the colours of the picture's light."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from tests.photo.pictures import ONE_PROCESS, drawn, found_in, speaking, still
from tts2face.models.baked_light import LIP_RING
from tts2face.models.face import Face
from tts2face.photo.photograph import Photograph
from tts2face.picture.options import Picture
from tts2face.picture.renderer import mesh_renderer

pytestmark = ONE_PROCESS

SIDE, NAME = 400, "head"


@pytest.fixture(scope="module")
def faces() -> dict[str, Face]:
    """The face of a picture, of a grey one and of a dark one."""
    coloured = still(NAME, SIDE)
    grey = np.repeat(coloured.mean(axis=2, keepdims=True), 3, axis=2).astype(np.uint8)
    pictures = {"coloured": coloured, "grey": grey, "dark": (coloured * 0.6).astype(np.uint8)}
    found = found_in(NAME, SIDE)
    return {name: speaking(Photograph(pixels, None, 1.0), found) for name, pixels in pictures.items()}


def inside(face: Face, part_name: str) -> np.ndarray:
    """Colours (N, 3) of a part of a face."""
    return face.colours[_rows(face, part_name)].astype(float)


def _rows(face: Face, part_name: str) -> np.ndarray:
    part = next(part for part in face.parts if part.name == part_name)
    return np.unique(face.triangles[part.first : part.first + part.count])


@pytest.mark.parametrize("part", ["tongue", "gums_upper", "teeth_upper", "walls"])
def test_a_grey_picture_has_a_grey_mouth(part: str, faces: dict[str, Face]) -> None:
    assert np.ptp(inside(faces["grey"], part), axis=1).max() <= 1
    assert np.ptp(inside(faces["coloured"], part), axis=1).max() > 8


def test_a_darker_picture_has_a_darker_mouth(faces: dict[str, Face]) -> None:
    light, dark = (inside(faces[name], "teeth_upper").mean() for name in ("coloured", "dark"))
    assert 0.5 < dark / light < 0.75


def test_the_dark_of_a_mouth_is_warm_and_lower_teeth_lie_in_the_shade(faces: dict[str, Face]) -> None:
    """What lips hardly part before is redder than in open light; in grey pictures it is grey."""
    for name in ("coloured", "grey"):
        light = faces[name].light.baked
        teeth = np.isin(light.mouth_rows, _rows(faces[name], "teeth_upper"))
        base, opened = light.mouth_base[teeth].astype(float), inside(faces[name], "teeth_upper")
        dark = base.mean(axis=0) / opened.mean(axis=0)
        assert dark[0] > 1.1 * dark[2] if name == "coloured" else np.ptp(dark) < 0.02
        assert 0.3 < dark.mean() < 0.6
    upper, lower = (
        np.percentile(inside(faces["coloured"], f"teeth_{row}").mean(axis=1), 90) for row in ("upper", "lower")
    )
    assert 0.6 < lower / upper < 0.95


def test_teeth_are_as_sharp_as_the_picture() -> None:
    found = found_in(NAME, SIDE)
    steepest = []
    for blur in (0.0, 2.5):
        pixels = gaussian_filter(still(NAME, SIDE), (blur, blur, 0)) if blur else still(NAME, SIDE)
        shown = drawn(mesh_renderer(speaking(Photograph(pixels, None, 1.0), found), Picture()), jawOpen=0.6)
        grey = shown.astype(float).mean(axis=2)
        slope = np.hypot(*np.gradient(grey))
        places = found.landmarks[list(LIP_RING), :2]
        (left, top), (right, bottom) = (places.min(axis=0).astype(int), places.max(axis=0).astype(int))
        steepest.append(np.percentile(slope[top : bottom + round(0.15 * SIDE), left:right], 98))
    sharp, soft = steepest
    assert soft < 0.6 * sharp
