"""Blender's own importer opens GLB files, where its package bpy is installed; it runs in a process of its own."""

import importlib.util
import json
import subprocess
import sys

import numpy as np
import pytest
from PIL import Image

import tts2face
from tests.interchange.exports.made import signed_clip, silent_clip, with_gesture
from tts2face.face.deformation import build_rig
from tts2face.interchange.exports.surfaces import divide_surface
from tts2face.models.face_loading import load_face
from tts2face.numeric.arrays import decode_srgb

pytestmark = pytest.mark.formats

FRAME = 12
SCRIPT = """
import json, sys
import bpy, numpy
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.context.scene.render.fps = 30
bpy.ops.import_scene.gltf(filepath=sys.argv[1])
mesh = next(one for one in bpy.data.objects if one.type == "MESH" and one.data.shape_keys)
bpy.context.scene.frame_set(int(sys.argv[2]))
shown = mesh.evaluated_get(bpy.context.evaluated_depsgraph_get())
places = numpy.zeros(3 * len(shown.data.vertices), numpy.float32)
shown.data.vertices.foreach_get("co", places)
world = numpy.array(shown.matrix_world)
places = places.reshape(-1, 3) @ world[:3, :3].T + world[:3, 3]
keys = {key.name: key.value for key in mesh.data.shape_keys.key_blocks}
names = [material.name for material in mesh.data.materials]
print("ANSWER" + json.dumps({"keys": keys, "places": places.tolist(), "materials": names}))
"""
LOCK_SCRIPT = """
import json, math, sys
import bpy
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.import_scene.gltf(filepath=sys.argv[1])
scene = bpy.context.scene
scene.render.engine, scene.cycles.samples, scene.cycles.use_denoising = "CYCLES", 16, False
scene.render.resolution_x = scene.render.resolution_y = 96
scene.view_settings.view_transform = "Standard"
scene.world = bpy.data.worlds.new("white")
scene.world.use_nodes = True
scene.world.node_tree.nodes["Background"].inputs[0].default_value = (1, 1, 1, 1)
camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
scene.collection.objects.link(camera)
scene.camera = camera
camera.location, camera.rotation_euler, camera.data.angle = (0, -1.4, 0), (math.pi / 2, 0, 0), 2 * math.atan(0.1)
scene.render.filepath = sys.argv[2]
bpy.ops.render.render(write_still=True)
"""
LOCKS = {  # rows and columns; CIELAB in the video
    "ada": ((slice(24, 52), slice(20, 28)), (34.6, 20.7, 20.3)),
    "head": ((slice(46, 70), slice(20, 26)), (17.9, 7.7, 11.5)),
}


def test_blender_shows_the_vertices_of_the_renderer(tmp_path):
    if importlib.util.find_spec("bpy") is None:
        pytest.skip("Blender's package bpy is not installed")
    face = with_gesture()
    clip = signed_clip(30, face)
    tts2face.export(clip, tmp_path / "a.glb", face=face)
    command = [sys.executable, "-c", SCRIPT, str(tmp_path / "a.glb"), str(FRAME)]
    printed = subprocess.run(command, capture_output=True, text=True, check=True, timeout=120).stdout
    answer = json.loads(next(line for line in printed.splitlines() if line.startswith("ANSWER")).removeprefix("ANSWER"))
    assert list(answer["keys"]) == ["Basis", *face.shape_names, "brows0Minus"]
    surfaces = divide_surface(face)
    assert answer["materials"] == [surface.part.name for surface in surfaces]
    weights = clip.motion.values[FRAME]
    values = list(answer["keys"].values())[1:]
    assert np.allclose(values[:4], weights[:4], rtol=0, atol=1e-4)
    assert np.allclose(9 * (values[4] - values[5]), weights[4], rtol=0, atol=1e-3)
    posed = build_rig(face).pose(weights, clip.head.values[FRAME]) / 1000
    expected = np.concatenate([posed[surface.vertices] for surface in surfaces])
    x, y, z = expected.T
    assert np.allclose(answer["places"], np.column_stack([x, -z, y]), rtol=0, atol=2e-5)  # z is up in Blender


def _lab(rgb):
    """CIELAB (3,) of an sRGB colour, 0 to 255."""
    linear = decode_srgb(np.asarray(rgb) / 255)
    x, y, z = (np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]) @ linear
               / [0.9505, 1, 1.089]) ** (1 / 3)  # fmt: skip
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


@pytest.mark.parametrize("name", LOCKS)
def test_blender_shows_hair_as_the_video_does(name, tmp_path):
    if importlib.util.find_spec("bpy") is None:
        pytest.skip("Blender's package bpy is not installed")
    face = load_face(name)
    tts2face.export(silent_clip(1, channels=face.shape_names), tmp_path / "a.glb", face=face)
    command = [sys.executable, "-c", LOCK_SCRIPT, str(tmp_path / "a.glb"), str(tmp_path / "a.png")]
    subprocess.run(command, capture_output=True, text=True, check=True, timeout=120)
    with Image.open(tmp_path / "a.png") as picture:
        pixels = np.asarray(picture.convert("RGB"), np.float64)
    lock, expected = LOCKS[name]
    shown = _lab(pixels[lock].mean(axis=(0, 1)))
    assert np.linalg.norm(shown - expected) < 8
    # no greyer than there
    assert np.linalg.norm(shown[1:]) / shown[0] > 0.75 * np.linalg.norm(expected[1:]) / expected[0]
