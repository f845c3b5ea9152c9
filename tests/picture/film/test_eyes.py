"""Eyes: the mirror image of the lamps, and the view transform."""

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

from tts2face.models.view_transform import table_levels
from tts2face.picture.baked.eyes import LAMP_LIGHT, N_ROWS, REFRACTION, look_up, mirror_lamps

CAMERA = np.zeros(15, np.float32)
SKY = np.array([0.1, 0.2, 0.3], np.float32)


def lamp_at(z: float, facing: float) -> np.ndarray:
    row = np.zeros(17, np.float32)
    row[2], row[3], row[7], row[11], row[12:14] = z, 1.0, 1.0, facing, 50.0
    row[LAMP_LIGHT:] = 7.0
    return row


def mirrored(lamps, normal=(0.0, 0.0, 1.0), point=(0.0, 0.0, -500.0)):
    rows = np.zeros((N_ROWS, 3), np.float32)
    rows[:6] = np.array([*point, *normal], np.float32)[:, None]
    mirror_lamps(CAMERA, np.array(lamps, np.float32).reshape(-1, 17), SKY, rows)
    assert (rows[6:9] == rows[6:9, :1]).all()
    return rows[6:9, 0]


def test_an_eye_mirrors_the_lamp_behind_the_camera_by_fresnels_share() -> None:
    share = ((REFRACTION - 1) / (REFRACTION + 1)) ** 2
    assert mirrored([lamp_at(300, -1)]) == pytest.approx(share * (SKY + 7), rel=1e-4)
    assert mirrored([lamp_at(300, 1)]) == pytest.approx(share * SKY, rel=1e-4)  # it shines the other way
    assert mirrored([lamp_at(-900, -1)]) == pytest.approx(share * SKY, rel=1e-4)  # it stands behind the eye
    assert mirrored([lamp_at(300, -1)], normal=(0, 0, -1)) == pytest.approx(0)


def test_a_mirrored_lamp_has_soft_edges_and_the_rim_mirrors_more() -> None:
    tilts = np.radians(np.linspace(0, 4, 60))
    seen = [mirrored([lamp_at(0, -1)], normal=(np.sin(a), 0, np.cos(a)))[0] for a in tilts]
    assert (np.diff(seen) < 1e-4).all()
    between = [value for value in seen if 1.2 * seen[-1] < value < 0.8 * seen[0]]
    assert len(between) >= 3
    flat = mirrored([], normal=(np.sin(1.4), 0, np.cos(1.4)))
    assert (flat > 5 * mirrored([])).all()


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
