"""Wrinkles deepen where brows rise and lips smile, as deep as the picture shows them, and not where a mouth opens."""

from dataclasses import replace

import numpy as np
import pytest

from tests.photo.pictures import found_in, photographed, projected, still
from tts2face.models.face import Face
from tts2face.models.face_loading import load_face
from tts2face.models.light import Photographed
from tts2face.photo.photograph import Photograph
from tts2face.photo.speaking_photo import speaking_photo
from tts2face.picture.options import Picture
from tts2face.picture.renderer import mesh_renderer

SIDE, NAME = 480, "head"
RAISED = {"browInnerUp": 0.8, "browOuterUpLeft": 0.8, "browOuterUpRight": 0.8}
SMILING = {"mouthSmileLeft": 0.8, "mouthSmileRight": 0.8}
FOREHEAD, FOLD, CHEEK, CHIN = 151, 206, 425, 199  # landmarks


def speaking(pixels: np.ndarray, smile: float = 0.0) -> Face:
    seen = photographed(Photograph(pixels, None, 1.0), found_in(NAME, SIDE), smile)
    return speaking_photo(seen, load_face("head", hair="bald"), {"name": "Ada"})


@pytest.fixture(scope="module")
def pixels() -> np.ndarray:
    return still(NAME, SIDE)


@pytest.fixture(scope="module")
def face(pixels: np.ndarray) -> Face:
    return speaking(pixels)


def shaded(face: Face, landmark: int, reach: float, **weights: float) -> np.ndarray:
    """Change (H, W) of the light around a landmark, of 255: the picture of a pose with that light and without it."""
    light = face.light.baked
    moving = light.responses.copy()
    moving[4:7] = 0
    posed = np.array([weights.get(name, 0.0) for name in face.shape_names], np.float32)
    lights = (Photographed(baked, face.light.view) for baked in (light, replace(light, responses=moving)))
    lit, plain = (
        mesh_renderer(replace(face, light=shown), Picture()).draw(posed).astype(float).mean(axis=2) for shown in lights
    )
    across, down = projected(NAME, SIDE, **weights)[landmark, :2].round().astype(int)
    reach = round(reach * SIDE)
    return (lit - plain)[down - reach : down + reach + 1, across - reach : across + reach + 1]


def test_lines_cross_the_forehead_of_raised_brows(face: Face) -> None:
    change = shaded(face, FOREHEAD, 0.05, **RAISED)
    rows = change.mean(axis=1)
    assert 1.0 < np.ptp(rows) < 12.0
    assert rows.std() > 2 * change.mean(axis=0).std()
    assert np.abs(shaded(face, FOREHEAD, 0.05, **SMILING)).max() <= 1
    assert np.abs(shaded(face, FOREHEAD, 0.05)).max() == 0


def test_folds_deepen_with_a_smile_and_not_with_the_jaw(face: Face) -> None:
    smiling, opened = (shaded(face, FOLD, 0.03, **weights) for weights in (SMILING, {"jawOpen": 0.5}))
    assert -14.0 < smiling.min() < -3.0
    assert np.abs(opened).max() < 0.4 * np.abs(smiling).max()
    assert np.abs(shaded(face, CHIN, 0.02, **SMILING)).max() <= 1


def test_a_smile_in_the_picture_has_its_folds_already(pixels: np.ndarray) -> None:
    assert np.abs(shaded(speaking(pixels, 1.0), FOLD, 0.03, **SMILING)).max() <= 1


def test_lines_of_the_picture_become_deeper(pixels: np.ndarray, face: Face) -> None:
    across, down = projected(NAME, SIDE)[FOREHEAD, :2].round().astype(int)
    lined = pixels.copy()
    rows, columns = slice(down - 2, down + 3), slice(across - 60, across + 61)
    lined[rows, columns] = (lined[rows, columns] * 0.9).astype(np.uint8)
    own, plain = (np.ptp(shaded(one, FOREHEAD, 0.05, **RAISED).mean(axis=1)) for one in (speaking(lined), face))
    assert own > 1.4 * plain
