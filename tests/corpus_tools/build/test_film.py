"""Film light: the path tracer's picture of a drawn character, where Blender's package bpy and MakeHuman's data are."""

from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from corpus_tools.drawn.build_drawn import CAST, drawn_face, face_masks
from corpus_tools.film.look import LAMPS, Look
from tests.characters.makehuman import makehuman
from tts2face.render.camera_views import CameraView

SIDE, SAMPLES = 96, 2


def test_lamps_shine_towards_the_face_and_the_key_is_the_strongest_from_in_front() -> None:
    ahead = {name: lamp.watts for name, lamp in LAMPS.items() if lamp.place[2] > 0 and not lamp.parts}
    assert max(ahead, key=lambda name: ahead[name]) == "key"
    assert ahead["key"] / ahead["fill"] == pytest.approx(13, abs=1)  # about 3 stops in power
    for lamp in LAMPS.values():
        assert np.linalg.norm(np.subtract(lamp.place, lamp.target)) > 3


def test_a_character_is_traced_in_its_light(tmp_path: Path) -> None:
    if find_spec("bpy") is None:
        pytest.skip("Blender's package bpy is not installed")
    source, character = makehuman(), CAST["ada"]
    face = drawn_face(source, character)
    from corpus_tools.film.scene import FilmScene

    scene = FilmScene(face, Look(), face_masks(source, character, face))
    scene.look_from(CameraView(0, 3, share=0.86), SIDE)
    shut = np.zeros(len(face.shape_names))
    shut[[face.shape_names.index(f"eyeBlink{side}") for side in ("Left", "Right")]] = 1.0
    pictures = {}
    for name, weights in {"rest": np.zeros(len(face.shape_names)), "shut": shut}.items():
        scene.pose(weights, np.zeros(6))
        scene.render(tmp_path / f"{name}.png", SAMPLES, has_wall=False)
        pictures[name] = np.asarray(Image.open(tmp_path / f"{name}.png")).astype(float)
    rest = pictures["rest"]
    covered = rest[:, :, 3] > 250
    assert 0.3 < covered.mean() < 0.9
    red, green, blue = rest[covered][:, :3].mean(axis=0)
    assert 250 > red > green > blue > 30  # skin, hair and wool are warm
    eyes = slice(int(0.45 * SIDE), int(0.6 * SIDE))
    assert np.abs(pictures["shut"] - rest)[eyes].mean() > 4 * np.abs(pictures["shut"] - rest)[int(0.8 * SIDE) :].mean()
