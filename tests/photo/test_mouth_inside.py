"""What lies behind lips has the colours of the picture's light."""

import numpy as np
import pytest

from tests.photo.pictures import found_in, photographed, still
from tts2face.models.face import Face
from tts2face.models.face_loading import load_face
from tts2face.photo.photograph import Photograph
from tts2face.photo.speaking_photo import speaking_photo

SIDE, NAME = 320, "head"


def inside(pixels: np.ndarray, part_name: str) -> np.ndarray:
    """Colours (N, 3) of a part of the face in a picture."""
    seen = photographed(Photograph(pixels, None, 1.0), found_in(NAME, SIDE))
    face: Face = speaking_photo(seen, load_face("head", hair="bald"), {"name": "Ada"})
    part = next(part for part in face.parts if part.name == part_name)
    return face.colours[np.unique(face.triangles[part.first : part.first + part.count])].astype(float)


@pytest.mark.parametrize("part", ["tongue", "gums_upper", "teeth_upper", "walls"])
def test_a_grey_picture_has_a_grey_mouth(part: str) -> None:
    coloured = still(NAME, SIDE)
    grey = np.repeat(coloured.mean(axis=2, keepdims=True), 3, axis=2).astype(np.uint8)
    assert np.ptp(inside(grey, part), axis=1).max() <= 1
    assert np.ptp(inside(coloured, part), axis=1).max() > 8


def test_a_darker_picture_has_a_darker_mouth() -> None:
    pixels = still(NAME, SIDE)
    light, dark = (inside(part, "teeth_upper").mean() for part in (pixels, (pixels * 0.6).astype(np.uint8)))
    assert 0.5 < dark / light < 0.75
