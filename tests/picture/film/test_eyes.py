"""Eyes: what they mirror, their catchlight, and the view transform."""

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

from tts2face.models.view_transform import table_levels
from tts2face.picture.baked.eyes import CATCHLIGHT, KEY, N_EYE_COLUMNS, N_ROWS, REFRACTION, look_up, shine
from tts2face.picture.catchlights import RIGHT, SCALE, STRENGTH, UP

CAMERA = np.zeros(15, np.float32)
SKY = np.array([0.1, 0.2, 0.3], np.float32)
KEY_LIGHT = 2.0


def shown(normal=(0.0, 0.0, 1.0), strength=0.0):
    """Light of a black eyeball, which has a catchlight in the direction of z."""
    rows, eye = np.zeros((N_ROWS, 3), np.float32), np.zeros((1, N_EYE_COLUMNS), np.float32)
    rows[:6] = np.array([0, 0, -500, *normal], np.float32)[:, None]
    eye[0, KEY:CATCHLIGHT], row = KEY_LIGHT, eye[0, CATCHLIGHT:]
    row[RIGHT], row[UP + 1], row[SCALE], row[STRENGTH] = 1, 1, 10, strength
    shine(CAMERA, eye, SKY, rows)
    assert (rows[6:9] == rows[6:9, :1]).all()
    return rows[6:9, 0]


def test_an_eye_mirrors_the_sky_by_fresnels_share_and_the_rim_mirrors_more() -> None:
    share = ((REFRACTION - 1) / (REFRACTION + 1)) ** 2
    assert shown() == pytest.approx(share * SKY, rel=1e-4)
    assert shown(normal=(0, 0, -1)) == pytest.approx(0)
    assert (shown(normal=(np.sin(1.4), 0, np.cos(1.4))) > 5 * shown()).all()


def test_a_catchlight_is_round_with_a_soft_edge() -> None:
    assert shown(strength=1) == pytest.approx(KEY_LIGHT, rel=1e-3)
    off = np.linspace(0, 0.2, 60)
    for way in ((1, 0), (0, 1), (0.6, -0.8)):
        seen = np.array([shown((way[0] * a, way[1] * a, np.sqrt(1 - a * a)), 1)[0] for a in off])
        assert (np.diff(seen) < 1e-4).all()
        assert ((seen > 0.2) & (seen < 1.8)).sum() > 10
        assert seen[-1] < 0.01


def test_the_view_transform_is_read_between_its_entries() -> None:
    rng = np.random.default_rng(0)
    levels = table_levels()
    view = rng.uniform(0, 255, (33, 33, 33, 3)).astype(np.float32)
    places = np.log(levels + 0.004)
    exact = RegularGridInterpolator((places,) * 3, view)
    light = rng.uniform(0, 12, (3, 50)).astype(np.float32)
    light[:, 0] = -1, 99, 0
    colour = np.zeros((3, 70), np.float32)
    look_up(view, light, np.arange(20, 70, dtype=np.int32), colour)
    assert pytest.approx(exact(np.log(light[:, 1:].T + 0.004)), abs=0.2) == colour[:, 21:].T
    assert colour[:, 20] == pytest.approx(view[0, 32, 0], abs=0.5)
    assert not colour[:, :20].any()
