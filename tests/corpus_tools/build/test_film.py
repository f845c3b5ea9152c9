"""Film light: the path tracer's picture of a drawn character, where Blender's package bpy and MakeHuman's data are."""

from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from corpus_tools.shipped.drawn.build_drawn import CAST, drawn_face, face_masks
from corpus_tools.shipped.drawn.hair import OtherHair
from corpus_tools.shipped.film.compare import View, differences, draw_view
from corpus_tools.shipped.film.fit_light import fit_light
from corpus_tools.shipped.film.look import LAMPS, Look
from corpus_tools.shipped.film.pose_light import PoseLight
from corpus_tools.shipped.film.poses import EXPRESSIONS, LitPose, expression_pose, farthest
from tests.interchange.characters.makehuman import makehuman
from tts2face.models.face_file import read_face, write_face
from tts2face.models.face_loading import load_face
from tts2face.models.hair_tint import tint_hair
from tts2face.models.light import Baked
from tts2face.models.view_transform import table_levels
from tts2face.picture.camera_view import CameraView, parse_camera

SIDE, SAMPLES = 96, 2


def test_lamps_shine_towards_the_face_and_the_key_is_the_strongest_from_in_front() -> None:
    ahead = {name: lamp.watts for name, lamp in LAMPS.items() if lamp.place[2] > 0 and not lamp.parts}
    assert max(ahead, key=lambda name: ahead[name]) == "key"
    assert ahead["key"] / ahead["fill"] == pytest.approx(13, abs=1)  # about 3 stops in power
    for lamp in LAMPS.values():
        assert np.linalg.norm(np.subtract(lamp.place, lamp.target)) > 3


@pytest.fixture(scope="module")
def scene() -> Any:
    """The drawn woman before the camera."""
    if find_spec("bpy") is None:
        pytest.skip("Blender's package bpy is not installed")
    from corpus_tools.shipped.film.scene import FilmScene

    source, character = makehuman(), CAST["ada"]
    face = drawn_face(source, character)
    made = FilmScene(face, Look(), face_masks(source, face))
    made.look_from(CameraView(0, 3, share=0.86), SIDE)
    return made


def test_a_character_is_traced_in_its_light(scene: Any, tmp_path: Path) -> None:
    face = scene.face
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


def test_light_is_baked_into_texels_and_vertices(scene: Any) -> None:
    from corpus_tools.shipped.film.bake import TexelBake, bake_vertices, displayed, view_table

    scene.pose(np.zeros(len(scene.face.shape_names)), np.zeros(6))
    skin = TexelBake(scene, ["skin"], SIDE).light(SAMPLES)
    lit = skin[skin.max(axis=2) > 0.05]
    assert len(lit) > 0.2 * SIDE**2
    assert (lit.mean(axis=0) == np.sort(lit.mean(axis=0))[::-1]).all()  # red, green, blue
    eyes = bake_vertices(scene, ["ball0", "ball1"], SAMPLES)
    assert all(light.max() > 0.2 for light in eyes.values())
    assert scene.objects["ball0"][0].data.materials[0] == scene.materials["eye"]  # as before
    table = view_table()
    grey = np.arange(len(table))
    greys = table[grey, grey, grey].mean(axis=1)
    assert (np.diff(greys) >= 0).all()
    assert (greys[0], greys[-1]) == (0, 1)
    assert table[16, 16, 16] == pytest.approx(displayed(np.full((1, 3), table_levels()[16], np.float32))[0], abs=1e-3)


def test_a_character_is_drawn_in_its_baked_light(scene: Any, tmp_path: Path) -> None:
    from corpus_tools.shipped.film.bake_poses import Effort, bake_poses

    face, still = scene.face, np.zeros(6, np.float32)
    shown = {"rest": {}, **{name: EXPRESSIONS[name] for name in ("a", "smile", "blink")}}
    poses = [LitPose(name, expression_pose(face, weights), still) for name, weights in shown.items()]
    turns = [np.radians([pitch, yaw, 0, 0, 0, 0]).astype(np.float32) for yaw, pitch in ((-20, 0), (20, 0), (0, 12))]
    poses += [LitPose(f"head {number}", poses[0].weights, head) for number, head in enumerate(turns)]
    effort = Effort(side=256, pose_side=192, rest=2, pose=1, turn=1, reference=2, mouth=2, small=1, wall=2)
    steps: list[str] = []
    n_hair = len(face.vertices) - int(face.triangles[face.parts[-1].first :].min())
    other = OtherHair(
        np.full((1, n_hair, 3), 170, np.uint8), np.array([CAST["ada"].palette.hair, (0.67,) * 3], np.float32)
    )
    baked = bake_poses(scene, poses, other, effort, steps.append)
    assert steps[1] == "rest"
    baked.save(tmp_path / "baked.npz")
    lit = replace(face, light=Baked(fit_light(face, PoseLight.load(tmp_path / "baked.npz"), Look(), CAST["ada"].eyes)))
    write_face(tmp_path / "lit.face", lit)
    lit = read_face(tmp_path / "lit.face")
    for pose in (poses[0], poses[1]):
        drawn, regions = draw_view(lit, View(pose, "front"), SIDE)
        scene.look_from(parse_camera("front"), SIDE)
        scene.pose(pose.weights, pose.head)
        scene.render(tmp_path / "traced.png", 8, has_wall=False)
        apart = differences(drawn, np.asarray(Image.open(tmp_path / "traced.png")), regions)
        assert apart["face"] < 12
        assert apart["hair"] < 20
        assert apart["mouth"] < 25
    blond = tint_hair(lit, "#ababab")
    assert np.abs(blond.light.baked.pages[1].mean() - lit.light.baked.pages[1].mean()) > 20
    scene.paint_hair(other.vertices[0])
    scene.pose(poses[0].weights, poses[0].head)
    scene.render(tmp_path / "blond.png", 8, has_wall=False)
    drawn, regions = draw_view(blond, View(poses[0], "front"), SIDE)
    apart = differences(drawn, np.asarray(Image.open(tmp_path / "blond.png")), regions)
    assert apart["hair"] < 20


def test_poses_lie_far_apart() -> None:
    face = load_face("head", hair="bald")
    frames = np.zeros((40, len(face.shape_names)), np.float32)
    frames[:, 3] = np.linspace(0, 1, 40)
    frames[20, 7] = 2.0
    assert farthest(frames, frames[:1], face, 3) == [20, 39, 19]
    blink = expression_pose(face, {"eyeBlink": 0.5, "jawOpen": 1.0})
    shown = {name for name, weight in zip(face.shape_names, blink, strict=True) if weight}
    assert shown == {"eyeBlinkLeft", "eyeBlinkRight", "jawOpen"}
