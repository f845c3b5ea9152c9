"""A VRM's own runtime (three-vrm) plays what is written: its expressions, head and gaze, from either file."""

import json
import os
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.interchange.characters.build.test_animation import made_clip
from tests.interchange.characters.made import write_landmarks
from tests.interchange.characters.made_vrm import TURN_DEG, write_vrm
from tests.interchange.exports import programs
from tts2face.face.deformation import head_rotation
from tts2face.interchange.characters.animation import write_character
from tts2face.interchange.characters.importing import import_face
from tts2face.models.face import Face
from tts2face.numeric.arrays import quaternion_matrix
from tts2face.types import Clip

HEAD = (0.1, 0.3, 0.05, 0.0, 0.0, 0.0)
POSE = {
    "jawOpen": 0.6, "mouthPucker": 0.3, "eyeBlinkLeft": 0.9, "eyeBlinkRight": 0.4, "browInnerUp": 0.5,
    "eyeLookOutLeft": 0.5, "eyeLookInRight": 0.5,
}  # fmt: skip
SHOWN = {"jawOpen", "mouthPucker", "eyeBlinkLeft", "eyeBlinkRight", "browInnerUp"}
PLAY = """
import {readFileSync} from 'node:fs'; import {pathToFileURL} from 'node:url'; import {join} from 'node:path';
globalThis.self = globalThis;
const [packages, avatar, motion, seconds] = process.argv.slice(1);
const from = path => import(pathToFileURL(join(packages, path)).href);
const THREE = await from('three/build/three.module.js');
const {GLTFLoader} = await from('three/examples/jsm/loaders/GLTFLoader.js');
const {VRMLoaderPlugin} = await from('@pixiv/three-vrm/lib/three-vrm.module.js');
const {VRMAnimationLoaderPlugin, VRMLookAtQuaternionProxy, createVRMAnimationClip} =
  await from('@pixiv/three-vrm-animation/lib/three-vrm-animation.module.js');
async function read(path) {
  const loader = new GLTFLoader(), bytes = readFileSync(path);
  loader.register(parser => new VRMLoaderPlugin(parser));
  loader.register(parser => new VRMAnimationLoaderPlugin(parser));
  loader.register(() => ({name: 'no-pictures', loadTexture: async () => new THREE.Texture()}));
  return loader.parseAsync(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength), '');
}
const {scene, userData: {vrm}} = await read(avatar), played = await read(motion);
const proxy = new VRMLookAtQuaternionProxy(vrm.lookAt);
proxy.name = 'gaze';
vrm.scene.add(proxy);
const clip = createVRMAnimationClip(played.userData.vrmAnimations[0], vrm);
const mixer = new THREE.AnimationMixer(vrm.scene), weights = {};
const action = mixer.clipAction(clip);
action.setLoop(THREE.LoopOnce);
action.clampWhenFinished = true;
action.play();
mixer.setTime(Number(seconds));
vrm.update(0);
scene.updateMatrixWorld(true);
scene.traverse(({morphTargetDictionary, morphTargetInfluences}) => {
  for (const name in morphTargetDictionary ?? {}) weights[name] = morphTargetInfluences[morphTargetDictionary[name]];
});
const turn = new THREE.Quaternion();
vrm.humanoid.getRawBoneNode('head').getWorldQuaternion(turn);
const {yaw, pitch} = vrm.lookAt;
console.log(JSON.stringify({duration: clip.duration, weights, head: turn.toArray(), yaw, pitch}));
"""


@pytest.fixture(scope="module", params=[0, 1], ids=["VRM 0", "VRM 1"])
def avatar(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Face, int]:
    """A VRM, and the face that was imported from it."""
    folder, version = tmp_path_factory.mktemp("vrm"), request.param
    path = write_vrm(folder / "avatar.vrm", version)
    return path, import_face(path, landmarks=write_landmarks(folder / "l.tsv", TURN_DEG[version])).face, version


def clip_of(face: Face) -> Clip:
    return made_clip(face, POSE, head=HEAD)


def play(avatar: Path, motion: Path, seconds: float) -> dict[str, Any]:
    """State of the runtime at a time of the motion."""
    packages = programs.node_package("@pixiv/three-vrm-animation")
    command = ["node", "--input-type=module", "-e", PLAY, str(packages), str(avatar), str(motion), str(seconds)]
    ran = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120, env=os.environ)
    assert ran.returncode == 0, ran.stderr[-800:]
    answer: dict[str, Any] = json.loads(ran.stdout.splitlines()[-1])
    return answer


def written(kind: str, face: Face, folder: Path) -> Path:
    import tts2face

    if kind == "own file":
        return write_character(clip_of(face), face, folder / "spoken.glb").path
    tts2face.export(clip_of(face), folder / "spoken.vrma", face=face)
    return folder / "spoken.vrma"


@pytest.mark.parametrize("kind", ["own file", "vrma"])
def test_the_runtime_shows_the_pose_of_the_clip(kind: str, avatar: tuple[Path, Face, int], tmp_path: Path) -> None:
    path, face, version = avatar
    motion, clip = written(kind, face, tmp_path), clip_of(face)
    end = clip.speech.waveform.duration
    shown = play(motion if kind == "own file" else path, motion, end)
    assert shown["duration"] == pytest.approx(end, abs=1e-6)
    found = {name: weight for name, weight in shown["weights"].items() if weight > 0.02}
    assert found == pytest.approx({name: POSE[name] for name in SHOWN}, abs=0.02)
    turned = quaternion_matrix(np.array(shown["head"]))
    half_turn = head_rotation(0.0, np.radians(TURN_DEG[version]), 0.0)
    assert np.allclose(half_turn.T @ turned, head_rotation(*HEAD[:3]), rtol=0, atol=1e-4)
    turn = face.eyes[0].turns["eyeLookOutLeft"][1] / 2
    assert np.radians(shown["yaw"]) == pytest.approx(turn, rel=0.35)
    assert abs(shown["pitch"]) < 3.0


def test_a_clip_of_any_face_moves_the_avatar(avatar: tuple[Path, Face, int], tmp_path: Path) -> None:
    import tts2face

    path, _, _ = avatar
    head = tts2face.load_face("head")
    tts2face.export(made_clip(head, {"jawOpen": 0.6, "eyeBlinkLeft": 0.8}), tmp_path / "any.vrma", face=head)
    shown = play(path, tmp_path / "any.vrma", 0.39)["weights"]
    assert shown["jawOpen"] > 0.5
    assert shown["eyeBlinkLeft"] == pytest.approx(0.8, abs=0.05)
    assert shown["eyeBlinkRight"] < 0.05
