"""GLB files: Khronos validator, pygltflib, OpenFaceFX and three.js read them; vertices are those of the renderer."""

import html
import io
import json
import re
import wave
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

import tts2face
from lexicon.errors import InputError
from lexicon.sequence import PhoneSequence
from tests.interchange.exports import programs
from tests.interchange.exports.made import FACE, RATE, made_clip, made_stream, signed_clip, turned_clip, with_gesture
from tests.packages import package
from tests.picture.test_cutouts import face_with_sheet
from tests.picture.tiny_face import tiny_face
from tts2face.face.deformation import build_rig, rotation_matrix
from tts2face.interchange.exports.plain_face import plain_face
from tts2face.interchange.exports.surfaces import divide_surface
from tts2face.interchange.gltf.container import GltfBuffer
from tts2face.numeric.arrays import continuous_quaternions, quaternion_matrix
from tts2face.storage.spool import Spool
from tts2face.types import HEAD_CHANNELS, Clip, Speech, Trajectory, Waveform

pytestmark = pytest.mark.formats

DTYPES = {5121: "u1", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
TOLERANCE_M = 1e-6  # of 32-bit metres
PAGE = """<html><body><script type="importmap">{"imports": {"three": "/three/build/three.module.js",
"three/addons/": "/three/examples/jsm/"}}</script><script type="module">
import * as THREE from 'three'; import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
const answer = document.createElement('pre');
try {
  const file = await new GLTFLoader().loadAsync('a.glb'), mixer = new THREE.AnimationMixer(file.scene);
  mixer.clipAction(file.animations[0]).play(); mixer.setTime(FRAME / 30); file.scene.updateMatrixWorld(true);
  const meshes = [], point = new THREE.Vector3();
  file.scene.traverse(mesh => { if (mesh.isSkinnedMesh) {
    mesh.skeleton.update(); const places = [];
    for (let at = 0; at < mesh.geometry.attributes.position.count; at += 7) {
      mesh.getVertexPosition(at, point); places.push([point.x, point.y, point.z]); }
    meshes.push({material: mesh.material.name, names: Object.keys(mesh.morphTargetDictionary), places}); } });
  answer.textContent = JSON.stringify({duration: file.animations[0].duration, meshes});
} catch (error) { answer.textContent = JSON.stringify({error: String(error.stack)}); }
document.body.append(answer);
</script></body></html>"""


ASSIMP = """
const fs = require('fs');
require('assimpjs')().then(assimp => {
  const files = new assimp.FileList();
  files.AddFile('a.glb', new Uint8Array(fs.readFileSync(process.argv[1])));
  const read = assimp.ConvertFileList(files, 'assjson');
  if (!read.IsSuccess()) throw new Error(read.GetErrorCode());
  const scene = JSON.parse(new TextDecoder().decode(read.GetFile(0).GetContent())), clip = scene.animations[0];
  console.log(JSON.stringify({meshes: scene.meshes.length, seconds: clip.duration / clip.tickspersecond})); });
"""


BABYLON = """
const {readFileSync} = require('node:fs'), {pathToFileURL} = require('node:url'), {join} = require('node:path');
const [path, packages, seconds] = process.argv.slice(1);
const from = name => import(pathToFileURL(join(packages, '@babylonjs', name)).href);
globalThis.XMLHttpRequest = class {};
console.log = () => {};
(async () => {
  const {NullEngine, Scene, SceneLoader} = await from('core/index.js');
  await from('loaders/glTF/index.js');
  const scene = new Scene(new NullEngine());
  const content = new Uint8Array(readFileSync(path));
  const read = await SceneLoader.ImportMeshAsync('', '', content, scene, undefined, '.glb');
  const [clip] = read.animationGroups;
  clip.start(false);
  clip.goToFrame(seconds * clip.targetedAnimations[0].animation.framePerSecond);
  const weights = {};
  for (const {morphTargetManager: targets} of read.meshes)
    for (let at = 0; at < (targets?.numTargets ?? 0); at++) {
      const {name, influence} = targets.getTarget(at);
      weights[name] = influence;
    }
  const rate = clip.targetedAnimations[0].animation.framePerSecond;
  process.stdout.write(JSON.stringify({weights, seconds: clip.to / rate}));
  process.exit(0);
})();
"""


class GltfFile:
    """A file as pygltflib reads it, and its values at a frame by the rules of the glTF specification."""

    def __init__(self, path):
        library = package("pygltflib")
        self.content = library.GLTF2().load(str(path))
        self.blob = self.content.binary_blob()

    def view(self, index, dtype, count):
        view = self.content.bufferViews[index]
        return np.frombuffer(self.blob, dtype, count, view.byteOffset or 0)

    def accessor(self, index):
        accessor = self.content.accessors[index]
        width, dtype = WIDTHS[accessor.type], DTYPES[accessor.componentType]
        values = np.zeros((accessor.count, width), dtype)
        if accessor.bufferView is not None:
            values = self.view(accessor.bufferView, dtype, accessor.count * width).reshape(-1, width).copy()
        if accessor.sparse is not None:
            sparse = accessor.sparse
            at = self.view(sparse.indices.bufferView, DTYPES[sparse.indices.componentType], sparse.count)
            values[at] = self.view(sparse.values.bufferView, dtype, sparse.count * width).reshape(-1, width)
        return values

    def animated(self, node_name, path):
        """Times and values of an animated property."""
        animation = self.content.animations[0]
        for channel in animation.channels:
            if (self.content.nodes[channel.target.node].name, channel.target.path) == (node_name, path):
                sampler = animation.samplers[channel.sampler]
                times = self.accessor(sampler.input).ravel()
                return times, self.accessor(sampler.output).reshape(len(times), -1)
        raise KeyError(node_name, path)

    def vertices(self, primitive, frame):
        """Skinned vertices (n, 3) of a primitive at a frame."""
        weights = self.animated("face", "weights")[1][frame]
        points = self.accessor(primitive.attributes.POSITION).astype(float)
        for weight, target in zip(weights, primitive.targets, strict=True):
            points = points + weight * self.accessor(target["POSITION"])
        joints, shares = self.accessor(primitive.attributes.JOINTS_0), self.accessor(primitive.attributes.WEIGHTS_0)
        matrices = self.joint_matrices(frame)
        moved = np.zeros_like(points)
        for corner in range(4):
            matrix = matrices[joints[:, corner]]
            moved += shares[:, [corner]] * (np.einsum("nij,nj->ni", matrix[:, :3, :3], points) + matrix[:, :3, 3])
        return moved

    def joint_matrices(self, frame):
        nodes, skin = self.content.nodes, self.content.skins[0]
        parents = {child: at for at, node in enumerate(nodes) for child in node.children or []}
        inverse = self.accessor(skin.inverseBindMatrices).reshape(-1, 4, 4).transpose(0, 2, 1)

        def place(at):
            local = np.eye(4)
            name = nodes[at].name
            local[:3, 3] = nodes[at].translation or (0, 0, 0)
            for path in ("translation", "rotation"):
                try:
                    value = self.animated(name, path)[1][frame]
                except KeyError:
                    continue
                if path == "translation":
                    local[:3, 3] = value
                else:
                    local[:3, :3] = quaternion_matrix(value)
            return place(parents[at]) @ local if at in parents else local

        return np.array([place(joint) @ inverse[number] for number, joint in enumerate(skin.joints)])


@pytest.mark.parametrize("face", [FACE, tiny_face(), with_gesture()], ids=["textured", "coloured", "gestures"])
def test_vertices_are_those_of_the_renderer(face, tmp_path):
    clip = signed_clip(5, face)
    tts2face.export(clip, tmp_path / "a.glb", face=face)
    file, rig = GltfFile(tmp_path / "a.glb"), build_rig(face)
    surfaces = divide_surface(face)
    primitives = file.content.meshes[0].primitives
    assert len(primitives) == len(surfaces) == 5
    for frame in (0, 3):
        expected = rig.pose(clip.motion.values[frame], clip.head.values[frame]) / 1000
        for primitive, surface in zip(primitives, surfaces, strict=True):
            found = file.vertices(primitive, frame)
            assert np.allclose(found, expected[surface.vertices], rtol=0, atol=TOLERANCE_M), surface.part.name
            corners = file.accessor(primitive.indices).reshape(-1, 3)
            assert np.array_equal(surface.vertices[corners], surface.vertices[surface.triangles])


def test_the_neck_stays_while_the_head_turns(tmp_path):
    face = tts2face.load_face("head")
    clip = turned_clip(2, channels=face.shape_names, yaw=0.3, pitch=0.1, y=4.0)
    tts2face.export(clip, tmp_path / "a.glb", face=face)
    shown = plain_face(face)
    is_kept = (shown.vertices == face.vertices).all(axis=1)  # others end the clothes
    file, rig = GltfFile(tmp_path / "a.glb"), build_rig(face)
    expected = rig.pose(clip.motion.values[0], clip.head.values[0]) / 1000
    for primitive, surface in zip(file.content.meshes[0].primitives, divide_surface(shown), strict=True):
        kept = is_kept[surface.vertices]
        assert kept.mean() > 0.9
        assert np.allclose(
            file.vertices(primitive, 0)[kept], expected[surface.vertices[kept]], rtol=0, atol=TOLERANCE_M
        )
    assert {"teeth_upper", "tongue", "lashes"} <= {material.name for material in file.content.materials}


@pytest.mark.parametrize(("channel", "axis"), [("pitch", 0), ("yaw", 1), ("roll", 2)])
def test_ten_degrees_are_a_quaternion_of_five(channel, axis, tmp_path):
    tts2face.export(turned_clip(**{channel: np.radians(10.0)}), tmp_path / "a.glb", face=FACE)
    times, turns = GltfFile(tmp_path / "a.glb").animated("head", "rotation")
    expected = np.zeros(4)
    expected[[axis, 3]] = np.sin(np.radians(5.0)), np.cos(np.radians(5.0))
    assert np.allclose(turns, expected, rtol=0, atol=1e-7)
    assert np.allclose(times[:-1], np.arange(4) / 30, rtol=0, atol=1e-7)


def test_metres_seconds_and_gaze(tmp_path):
    motion = np.zeros((2, 4), np.float32)
    motion[1, FACE.shape_names.index("eyeLookInLeft")] = 1.0
    still = turned_clip(2, 29.97, x=10.0)
    clip = Clip(Trajectory(FACE.shape_names, motion, 29.97), still.head, still.speech)
    tts2face.export(clip, tmp_path / "a.glb", face=FACE)
    file = GltfFile(tmp_path / "a.glb")
    times, places = file.animated("head", "translation")
    assert np.allclose(places, FACE.pivot / 1000 + [0.01, 0, 0], rtol=0, atol=1e-7)
    assert times[1] == pytest.approx(1001 / 30000, abs=1e-7)
    turns = file.animated("leftEye", "rotation")[1]
    turn = FACE.eyes[0].turns["eyeLookInLeft"]
    assert np.allclose(quaternion_matrix(turns[1]), rotation_matrix(turn), rtol=0, atol=1e-6)
    extras = file.content.asset.extras
    assert (extras["fps"], extras["sound"]) == (pytest.approx(30000 / 1001), "a.wav")
    assert extras["digitalSourceType"].endswith("/trainedAlgorithmicMedia")


def test_a_gesture_of_both_directions_has_two_targets_with_weights_from_0_to_1(tmp_path):
    face = with_gesture()
    motion = np.zeros((3, 5), np.float32)
    motion[:, 4], motion[:, 0] = [4.5, 0.0, -9.0], [0.0, 0.5, 1.0]
    clip = made_clip(3, 30.0, face.shape_names)
    clip = Clip(Trajectory(face.shape_names, motion, 30.0), clip.head, clip.speech)
    tts2face.export(clip, tmp_path / "a.glb", face=face)
    file = GltfFile(tmp_path / "a.glb")
    assert file.content.meshes[0].extras["targetNames"] == [*FACE.shape_names, "brows0", "brows0Minus"]
    weights = file.animated("face", "weights")[1]
    assert np.allclose(weights[:, 4:], [[0.5, 0], [0, 0], [0, 1], [0, 1]], rtol=0, atol=1e-7)
    assert np.array_equal(weights[:-1, 0], motion[:, 0])


@pytest.mark.parametrize(("n_frames", "fps", "export_fps", "cut"), [
    (30, 30.0, None, 0), (30, 30.0, None, 300), (45, 25.0, 60.0, 0), (45, 25.0, 24.0, 90), (7, 29.97, None, 0),
])  # fmt: skip
def test_the_last_frame_holds_to_the_end_of_the_sound(n_frames, fps, export_fps, cut, tmp_path):
    clip = made_clip(n_frames, fps)
    sound = Waveform(clip.speech.waveform.samples[: len(clip.speech.waveform.samples) - cut], RATE)
    phones = PhoneSequence(clip.speech.phones.phones, np.append(clip.speech.phones.edges[:-1], sound.duration))
    clip = Clip(clip.motion, clip.head, Speech(sound, phones, clip.speech.words))
    tts2face.export(clip, tmp_path / "a.glb", face=FACE, fps=export_fps)
    file = GltfFile(tmp_path / "a.glb")
    for node, path in (("face", "weights"), ("head", "rotation"), ("head", "translation")):
        times, rows = file.animated(node, path)
        assert times[-1] == pytest.approx(sound.duration, abs=1e-6)
        assert (np.diff(times) > 0).all()
        assert np.array_equal(rows[-1], rows[-2])


def test_still_displacements_share_zeros_and_each_has_a_view(tmp_path):
    face = tts2face.load_face("head")
    tts2face.export(made_clip(2, channels=face.shape_names), tmp_path / "a.glb", face=face)
    content = GltfFile(tmp_path / "a.glb").content
    assert all(accessor.bufferView is not None for accessor in content.accessors)
    moved = [accessor for accessor in content.accessors if accessor.sparse]
    targets = [target["POSITION"] for primitive in content.meshes[0].primitives for target in primitive.targets]
    assert len(targets) > 4 * len(moved)
    assert len(set(targets)) <= len(moved) + len(content.meshes[0].primitives)


def test_a_copy_by_pygltflib_is_valid(tmp_path):
    packages, pygltflib = programs.node_package("gltf-validator"), package("pygltflib")
    tts2face.export(made_clip(2), tmp_path / "a.glb", face=FACE)
    pygltflib.GLTF2().load(str(tmp_path / "a.glb")).save(str(tmp_path / "b.glb"))
    report = json.loads(programs.run_node(programs.VALIDATE, packages, str(tmp_path / "b.glb")))
    assert (report["issues"]["numErrors"], report["issues"]["numWarnings"]) == (0, 0), report["issues"]["messages"]


def test_assimp_reads_parts_that_do_not_move(tmp_path):
    packages = programs.node_package("assimpjs")
    tts2face.export(made_clip(4), tmp_path / "a.glb", face=FACE)
    answer = json.loads(programs.run_node(ASSIMP, packages, str(tmp_path / "a.glb")))
    assert answer["meshes"] == len(divide_surface(FACE))
    assert answer["seconds"] == pytest.approx(4 / 30, abs=1e-3)


@pytest.mark.build
def test_babylon_plays_the_weights_of_the_clip(tmp_path):
    packages = programs.node_package("@babylonjs/loaders")
    clip = made_clip(12)
    tts2face.export(clip, tmp_path / "a.glb", face=FACE)
    answer = json.loads(programs.run_node(BABYLON, packages, str(tmp_path / "a.glb"), str(packages), str(6 / 30)))
    assert answer["seconds"] == pytest.approx(0.4, abs=1e-3)
    expected = dict(zip(FACE.shape_names, clip.motion.values[6].tolist(), strict=True))
    assert answer["weights"] == pytest.approx(expected, abs=2e-3)


def test_openfacefx_reads_names_and_weights(tmp_path):
    importers = package("openfacefx.importers_gltf")
    clip = made_clip(20, 30.0)
    tts2face.export(clip, tmp_path / "a.glb", face=FACE)
    track, warnings = importers.read_gltf(str(tmp_path / "a.glb"), epsilon=0.0)
    assert not warnings
    assert track.fps == pytest.approx(30.0, abs=2e-3)  # it divides the keys by the time up to the end of the sound
    for column, name in enumerate(FACE.shape_names):
        keys = next(channel for channel in track.channels if channel.name == name).keys
        times, values = np.array([(key.time, key.value) for key in keys]).T
        read = np.interp(np.arange(20) / 30, times, values)
        assert np.allclose(read, clip.motion.values[:, column], rtol=0, atol=1e-3)  # it keeps four decimals


def test_speech_without_gestures_has_only_its_own_targets(tmp_path):
    face = with_gesture()
    tts2face.export(made_clip(channels=FACE.shape_names), tmp_path / "a.glb", face=face)
    assert GltfFile(tmp_path / "a.glb").content.meshes[0].extras["targetNames"] == list(FACE.shape_names)


def test_the_likeness_of_a_person_is_marked_as_synthetic(tmp_path):
    person = replace(FACE, metadata={"name": "Ada", "consent": "I agree", "licence": "private"})
    tts2face.export(made_clip(), tmp_path / "a.glb", face=person)
    asset = GltfFile(tmp_path / "a.glb").content.asset
    assert asset.extras["notice"] == "Synthetic media: face and lip motion of Ada were generated by tts2face"
    assert asset.copyright == "private"


def test_the_sound_lies_beside_it(tmp_path):
    tts2face.export(made_stream(2), tmp_path / "a.glb", face=FACE)
    with wave.open(str(tmp_path / "a.wav")) as file:
        assert file.getnframes() == 2 * RATE


@pytest.mark.parametrize(
    ("face", "n_frames"), [(FACE, 30), (FACE, 1), (tiny_face(), 3), ("head", 2), ("ada", 2)], ids=str
)
def test_the_khronos_validator_finds_nothing(face, n_frames, tmp_path):
    packages = programs.node_package("gltf-validator")
    mesh = tts2face.load_face(face) if isinstance(face, str) else with_gesture(face)
    tts2face.export(made_clip(n_frames, channels=mesh.shape_names), tmp_path / "a.glb", face=mesh)
    report = json.loads(programs.run_node(programs.VALIDATE, packages, str(tmp_path / "a.glb")))
    issues = report["issues"]
    assert (issues["numErrors"], issues["numWarnings"]) == (0, 0), issues["messages"]
    assert report["info"]["animationCount"] == 1


def test_parts_with_holes_are_masked_by_the_alpha_of_the_texture(tmp_path):
    pygltflib = package("pygltflib")
    alpha = np.arange(4096, dtype=np.uint16).reshape(64, 64).astype(np.uint8)
    face = face_with_sheet(alpha)
    tts2face.export(made_clip(2, channels=face.shape_names), tmp_path / "a.glb", face=face)
    file = pygltflib.GLTF2().load(str(tmp_path / "a.glb"))
    assert {material.name: material.alphaMode for material in file.materials}["lashes"] == "MASK"
    view = file.bufferViews[file.images[0].bufferView]
    content = file.binary_blob()[view.byteOffset : view.byteOffset + view.byteLength]
    pixels = np.array(Image.open(io.BytesIO(content)))
    assert np.array_equal(pixels, np.dstack([face.textures[0].pixels, alpha]))


def test_three_js_shows_the_vertices_of_the_renderer(tmp_path):
    packages = programs.node_package("three")
    programs.browser()
    face, frame = with_gesture(), 12
    clip = signed_clip(30, face)
    tts2face.export(clip, tmp_path / "a.glb", face=face)
    (tmp_path / "three").symlink_to(packages / "three")
    (tmp_path / "index.html").write_text(PAGE.replace("FRAME", str(frame)))
    with programs.served(tmp_path) as address:
        document = programs.page_content(f"{address}/index.html", "</pre>")
    answer = json.loads(html.unescape(re.search("<pre>(.*)</pre>", document, re.DOTALL)[1]))
    assert "error" not in answer, answer
    assert answer["duration"] == pytest.approx(1.0, abs=1e-6)
    expected = build_rig(face).pose(clip.motion.values[frame], clip.head.values[frame]) / 1000
    surfaces = {surface.part.name: surface for surface in divide_surface(face)}
    assert {mesh["material"] for mesh in answer["meshes"]} == set(surfaces)
    for mesh in answer["meshes"]:
        assert mesh["names"] == [*face.shape_names, "brows0Minus"]
        own = surfaces[mesh["material"]].vertices[::7]
        assert np.allclose(mesh["places"], expected[own], rtol=0, atol=2e-6)  # the animation has 32-bit times


def test_quaternions_of_neighbours_lie_on_the_same_side():
    turns = np.array([[0, 0, 0, 1.0], [0, 0, 0.1, -1.0], [0, 0, 0.2, -1.0], [0, 0, 0, 1.0]])
    signed = continuous_quaternions(turns, None)
    assert (np.einsum("td,td->t", signed[1:], signed[:-1]) > 0).all()
    assert np.allclose(np.abs(signed), np.abs(turns), rtol=0, atol=0)
    rest = continuous_quaternions(turns[2:], signed[1])
    assert np.array_equal(rest, signed[2:])


def test_a_file_beyond_four_gigabytes_is_refused(tmp_path):
    class Large(Spool):
        n_bytes = 2**32

    buffer, large = GltfBuffer(), Large(1)
    large.close()
    buffer.add_view(large)
    with pytest.raises(InputError, match=r"a.glb would have 4.3 GB; a .glb file holds 4 GB"):
        buffer.write(tmp_path / "a.glb", {})


def test_head_channels_are_in_the_order_that_the_tests_assume():
    assert HEAD_CHANNELS == ("pitch", "yaw", "roll", "x", "y", "z")
