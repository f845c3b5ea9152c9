"""The neck of a skinned character takes a share of the head's rotation; three.js and Blender show the same vertices."""

import html
import importlib.util
import json
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.interchange.characters.build.test_animation import FPS, N_FRAMES, Played, made_clip
from tests.interchange.characters.made import METRES, Variant, shipped_head, write_character_file, write_landmarks
from tests.interchange.exports import programs
from tts2face.face.deformation import head_rotation, rotation_matrix
from tts2face.interchange.characters.animation import write_character
from tts2face.interchange.characters.bone_tracks import NECK_SHARE, share_of_rotation
from tts2face.interchange.characters.importing import import_face
from tts2face.models.face import VERTEX_COLOURS
from tts2face.numeric.arrays import quaternion_matrix

POSE = (0.25, -0.4, 0.1)  # pitch, yaw, roll of the last frame, rad
NECK = np.array([0.0, -0.12, -0.09])  # of the made character, metres
HEAD_ABOVE, NECK_BELOW = -0.115, -0.205  # heights, metres, beyond which vertices follow one bone only
WITHIN = 2e-5  # metres
PAGE = """<html><body><script type="importmap">{"imports": {"three": "/three/build/three.module.js",
"three/addons/": "/three/examples/jsm/"}}</script><script type="module">
import * as THREE from 'three'; import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
const answer = document.createElement('pre');
try {
  const file = await new GLTFLoader().loadAsync('a.glb'), mixer = new THREE.AnimationMixer(file.scene);
  const point = new THREE.Vector3();
  const read = () => { file.scene.updateMatrixWorld(true); const places = [];
    file.scene.traverse(mesh => { if (!mesh.isSkinnedMesh || !mesh.morphTargetInfluences) return;
      mesh.skeleton.update();
      for (let at = 0; at < mesh.geometry.attributes.position.count; at += 5) {
        mesh.getVertexPosition(at, point).applyMatrix4(mesh.matrixWorld);
        places.push([point.x, point.y, point.z]); } });
    return places; };
  const rest = read();
  const action = mixer.clipAction(file.animations[0]); action.setLoop(THREE.LoopOnce); action.clampWhenFinished = true;
  action.play(); mixer.setTime(SECONDS);
  answer.textContent = JSON.stringify({rest, shown: read()});
} catch (error) { answer.textContent = JSON.stringify({error: String(error.stack)}); }
document.body.append(answer);
</script></body></html>"""
SCRIPT = """
import json, sys
import bpy, numpy
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.context.scene.render.fps = 25
bpy.ops.import_scene.gltf(filepath=sys.argv[1])
mesh = next(one for one in bpy.data.objects if one.type == "MESH" and one.data.shape_keys)
answer = {}
for name, frame in (("rest", 0), ("shown", int(sys.argv[2]))):
    bpy.context.scene.frame_set(frame)
    shown = mesh.evaluated_get(bpy.context.evaluated_depsgraph_get())
    places = numpy.zeros(3 * len(shown.data.vertices), numpy.float32)
    shown.data.vertices.foreach_get("co", places)
    world = numpy.array(shown.matrix_world)
    x, y, z = (places.reshape(-1, 3) @ world[:3, :3].T + world[:3, 3]).T
    answer[name] = numpy.column_stack([x, z, -y])[::5].tolist()  # z is up in Blender
print("ANSWER" + json.dumps(answer))
"""


@pytest.fixture(scope="module")
def spoken(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("neck")
    head = shipped_head()
    parts = tuple(replace(part, texture=VERTEX_COLOURS) for part in head.parts)
    plain = replace(head, parts=parts, uv=None, textures=())  # the browser waits long for pictures
    character = write_character_file(folder / "character.glb", Variant(is_skinned=True, turn_deg=180.0), plain)
    table = write_landmarks(folder / "landmarks.tsv", 180.0)
    face = import_face(character, landmarks=table, front="-z").face
    write_character(made_clip(face, {}, head=(*POSE, 0.0, 0.0, 0.0)), face, folder / "spoken.glb")
    return folder / "spoken.glb"


def turned_about() -> np.ndarray:
    """Rotation of the made character, which looks along -z."""
    return np.diag([-1.0, 1.0, -1.0])


def expected(rest: np.ndarray) -> np.ndarray:
    """Places (N, 3), metres, at the last frame, of vertices at rest (N, 3) that follow only the head or the neck."""
    about = turned_about()
    head = about @ head_rotation(*POSE) @ about.T
    neck = share_of_rotation(head, NECK_SHARE)
    base, pivot = about @ NECK, about @ (shipped_head().pivot.astype(float) * METRES)
    shifted = base + neck @ (pivot - base)
    on_head = rest[:, 1:2] > HEAD_ABOVE
    return np.where(on_head, shifted + (rest - pivot) @ head.T, base + (rest - base) @ neck.T)


def check_places(rest: np.ndarray, shown: np.ndarray) -> None:
    one_bone = (rest[:, 1] > HEAD_ABOVE) | (rest[:, 1] < NECK_BELOW)
    assert (rest[one_bone, 1] < NECK_BELOW).sum() > 20
    assert (rest[one_bone, 1] > HEAD_ABOVE).sum() > 1000
    assert np.abs(expected(rest[one_bone]) - shown[one_bone]).max() < WITHIN


def test_neck_and_head_together_turn_by_the_pose(spoken: Path) -> None:
    played = Played(spoken)
    neck, head = (quaternion_matrix(played.track("rotation", name)[-1]) for name in ("Neck", "Head"))
    np.testing.assert_allclose(neck @ head, head_rotation(*POSE), atol=1e-6)
    angles = [np.arccos((np.trace(turn) - 1) / 2) for turn in (neck, head)]
    assert angles[0] / sum(angles) == pytest.approx(NECK_SHARE, abs=1e-5)


def test_a_share_of_a_rotation_has_its_axis() -> None:
    random = np.random.default_rng(2)
    for _ in range(50):
        vector = random.normal(size=3)
        vector *= random.uniform(0, 3.1) / np.linalg.norm(vector)
        np.testing.assert_allclose(
            share_of_rotation(rotation_matrix(vector), 0.3), rotation_matrix(0.3 * vector), atol=1e-9
        )
    np.testing.assert_array_equal(share_of_rotation(np.eye(3), 0.3), np.eye(3))


def test_three_js_turns_neck_and_head(spoken: Path, tmp_path: Path) -> None:
    packages = programs.node_package("three")
    programs.browser()
    (tmp_path / "three").symlink_to(packages / "three")
    (tmp_path / "a.glb").symlink_to(spoken)
    (tmp_path / "index.html").write_text(PAGE.replace("SECONDS", str((N_FRAMES - 1) / FPS)))
    with programs.served(tmp_path) as address:
        document = programs.page_content(f"{address}/index.html", "</pre>")
    answer = json.loads(html.unescape(re.search("<pre>(.*)</pre>", document, re.DOTALL)[1]))
    assert "error" not in answer, answer
    check_places(np.array(answer["rest"]), np.array(answer["shown"]))


def test_blender_turns_neck_and_head(spoken: Path) -> None:
    if importlib.util.find_spec("bpy") is None:
        pytest.skip("Blender's package bpy is not installed")
    command = [sys.executable, "-c", SCRIPT, str(spoken), str(N_FRAMES - 1)]
    printed = subprocess.run(command, capture_output=True, text=True, check=True, timeout=120).stdout
    answer = json.loads(next(line for line in printed.splitlines() if line.startswith("ANSWER")).removeprefix("ANSWER"))
    check_places(np.array(answer["rest"]), np.array(answer["shown"]))
