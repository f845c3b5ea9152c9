"""Animation on a character's own file, read back by another reader and compared with the face."""

import json
import struct
import wave
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from cli.main import run
from lexicon.errors import DataError, InputError
from lexicon.sequence import PhoneSequence
from tests.interchange.characters.made import (
    METRES,
    Variant,
    glb,
    shipped_head,
    split_glb,
    write_character_file,
    write_landmarks,
)
from tests.interchange.exports import programs
from tests.packages import package
from tests.walkers import unmarked
from tts2face.face.deformation import build_rig
from tts2face.interchange.characters.animation import write_character
from tts2face.interchange.characters.bone_tracks import NECK_SHARE
from tts2face.interchange.characters.importing import import_face
from tts2face.models.face import Face
from tts2face.models.face_file import read_face
from tts2face.session.session import Session
from tts2face.types import HEAD_CHANNELS, Clip, Speech, Trajectory, Waveform

FPS, N_FRAMES = 25.0, 10
TOLERANCE_MM = 0.05
SHARED = {"plain": Variant(), "skinned": Variant(is_skinned=True), "forward": Variant(turn_deg=0.0)}


def made_clip(face: Face, poses: dict[str, float], head: tuple[float, ...] = (0.0,) * 6) -> Clip:
    """A clip that goes from rest to a pose."""
    ramp = np.linspace(0.0, 1.0, N_FRAMES)[:, None]
    values = ramp * np.array([poses.get(name, 0.0) for name in face.shape_names])
    seconds = N_FRAMES / FPS
    speech = Speech(
        waveform=Waveform(np.zeros(round(seconds * 8000), np.float32), 8000),
        phones=PhoneSequence(("sil",), np.array([0.0, seconds])),
        words=(),
    )
    motion = Trajectory(face.shape_names, values.astype(np.float32), FPS)
    return Clip(motion, Trajectory(HEAD_CHANNELS, (ramp * np.array(head)).astype(np.float32), FPS), speech)


class Played:
    """A .glb file as pygltflib reads it, with its first animation at its last frame."""

    def __init__(self, path: Path) -> None:
        pygltflib = package("pygltflib")
        self.gltf = pygltflib.GLTF2().load(str(path))
        self.root, self.binary = split_glb(path.read_bytes())
        self.animation = self.gltf.animations[0]

    def rows(self, number: int) -> np.ndarray:
        accessor = self.gltf.accessors[number]
        view = self.gltf.bufferViews[accessor.bufferView]
        width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[accessor.type]
        start = (view.byteOffset or 0) + (accessor.byteOffset or 0)
        return np.frombuffer(self.gltf.binary_blob(), "<f4", accessor.count * width, start).reshape(-1, width)

    def track(self, path: str, name: str) -> np.ndarray:
        for channel in self.animation.channels:
            node = self.gltf.nodes[channel.target.node]
            if channel.target.path == path and (node.name or "").endswith(name):
                return self.rows(self.animation.samplers[channel.sampler].output)
        raise AssertionError(f"no {path} of {name}")

    def weights(self) -> dict[str, float]:
        names = self.root["meshes"][0]["extras"]["targetNames"]
        last = self.track("weights", "Face" if self.root.get("skins") is None else "FaceMesh")[-len(names) :, 0]
        return dict(zip(names, last.tolist(), strict=True))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("animated")


def imported(folder: Path, name: str, variant: Variant) -> Face:
    character = write_character_file(folder / f"{name}.glb", variant)
    return import_face(character, landmarks=write_landmarks(folder / "landmarks.tsv")).face


@pytest.fixture(scope="module")
def shared(folder: Path) -> Callable[[str], Face]:
    """A face of `SHARED`, imported once from the file of its name."""
    return cache(lambda name: imported(folder, name, SHARED[name]))


def test_weights_of_the_own_targets_are_those_of_the_clip(folder: Path) -> None:
    face = imported(folder, "renamed", Variant(rename=lambda name: f"BS.{name}"))
    clip = made_clip(face, {"jawOpen": 0.6, "mouthSmileLeft": 0.3, "eyeBlinkRight": 1.0})
    written = write_character(clip, face, folder / "renamed_out.glb")
    played = Played(folder / "renamed_out.glb")
    weights = played.weights()
    assert weights["BS.jawOpen"] == pytest.approx(0.6, abs=1e-6)
    assert {name for name, weight in weights.items() if weight} == {
        "BS.jawOpen", "BS.mouthSmileLeft", "BS.eyeBlinkRight",
    }  # fmt: skip
    times = played.rows(played.animation.samplers[0].input)[:, 0]
    np.testing.assert_allclose(times, np.arange(N_FRAMES + 1) / FPS, atol=1e-6)  # the last key: the end of the sound
    assert written.n_frames == N_FRAMES
    with wave.open(str(folder / "renamed_out.wav")) as sound:
        assert sound.getnframes() == round(N_FRAMES / FPS * 8000)


def test_a_posed_character_lies_where_the_posed_face_does(folder: Path, shared: Callable[[str], Face]) -> None:
    face, head = shared("plain"), shipped_head()
    poses = {"jawOpen": 0.7, "mouthPucker": 0.4, "browInnerUp": 0.5}
    write_character(made_clip(face, poses), face, folder / "posed_out.glb")
    weights = Played(folder / "posed_out.glb").weights()
    own = head.vertices + np.einsum("k,kvd->vd", [weights[name] for name in head.shape_names], head.shapes)
    pose = np.array([poses.get(name, 0.0) for name in face.shape_names], np.float32)
    shown = build_rig(face).pose(pose)
    chin = int(face.landmark_vertices[face.landmarks == 152][0, 0])
    nearest = np.linalg.norm(head.vertices - (face.vertices[chin] - [0, 0, 0]), axis=1).argmin()
    moved_there, moved_here = own[nearest] - head.vertices[nearest], shown[chin] - face.vertices[chin]
    assert np.abs(moved_there - moved_here).max() < TOLERANCE_MM


def test_one_target_for_both_sides_gets_their_mean(folder: Path) -> None:
    variant = Variant(merged={"mouthSmile": ("mouthSmileLeft", "mouthSmileRight")})
    face = imported(folder, "merged", variant)
    clip = made_clip(face, {"mouthSmileLeft": 0.8, "mouthSmileRight": 0.4})
    write_character(clip, face, folder / "merged_out.glb")
    assert Played(folder / "merged_out.glb").weights()["mouthSmile"] == pytest.approx(0.6, abs=1e-6)


def test_head_and_eye_bones_turn(folder: Path, shared: Callable[[str], Face]) -> None:
    face = shared("skinned")
    clip = made_clip(face, {"eyeLookOutLeft": 1.0}, head=(0.0, 0.3, 0.0, 0.0, 0.0, 0.0))
    written = write_character(clip, face, folder / "bones_out.glb")
    played = Played(folder / "bones_out.glb")
    assert set(written.bones) == {"neck", "head", "leftEye", "rightEye"}
    for bone, share in (("Neck", NECK_SHARE), ("Head", 1 - NECK_SHARE)):
        half = 0.15 * share  # of the angle about the vertical axis, rad
        np.testing.assert_allclose(played.track("rotation", bone)[-1], [0, np.sin(half), 0, np.cos(half)], atol=1e-6)
    angle = face.eyes[0].turns["eyeLookOutLeft"][1] / 2
    np.testing.assert_allclose(played.track("rotation", "LeftEye")[-1], [0, np.sin(angle), 0, np.cos(angle)], atol=1e-6)


def test_a_head_without_bones_turns_about_the_pivot_of_the_face(folder: Path, shared: Callable[[str], Face]) -> None:
    face = shared("forward")
    clip = made_clip(face, {}, head=(0.2, 0.0, 0.0, 0.0, 5.0, 0.0))
    write_character(clip, face, folder / "still_out.glb")
    played = Played(folder / "still_out.glb")
    x, y, z, w = played.track("rotation", "tts2face_head")[-1].astype(float)
    shift = played.track("translation", "tts2face_head")[-1] / METRES
    assert (y, z) == (0.0, 0.0)
    cos, sin = w * w - x * x, 2 * x * w
    turn = np.array([[1, 0, 0], [0, cos, -sin], [0, sin, cos]])
    eye_shift = np.array([0.0, 0.0, 0.5457])  # the fitted centre of the eyeballs in the head's own axes
    place = shipped_head().vertices[100].astype(float)
    pose = np.zeros(len(face.shape_names), np.float32)
    nearest = int(np.linalg.norm(face.vertices + eye_shift - place, axis=1).argmin())
    shown = build_rig(face).pose(pose, clip.head.values[-1])[nearest] + eye_shift
    if build_rig(face).follow[nearest] == 1.0:
        assert np.abs(turn @ place + shift - shown).max() < TOLERANCE_MM


def test_eyeballs_that_are_nodes_without_bones_turn_about_their_centres(
    folder: Path, shared: Callable[[str], Face]
) -> None:
    face = shared("forward")
    write_character(made_clip(face, {"eyeLookUpRight": 1.0}), face, folder / "nodes_out.glb")
    played = Played(folder / "nodes_out.glb")
    x, y, z, w = played.track("rotation", "RightEye")[-1].astype(float)
    shift = played.track("translation", "RightEye")[-1].astype(float)
    assert (y, z) == (0.0, 0.0)
    cos, sin = w * w - x * x, 2 * x * w
    turn = np.array([[1, 0, 0], [0, cos, -sin], [0, sin, cos]])
    centre = shipped_head().eyes[1].centre.astype(float) * METRES
    assert np.abs(turn @ centre + shift - centre).max() < 0.5 * METRES  # the fitted centre is 0.55 mm off
    assert np.arctan2(sin, cos) == pytest.approx(face.eyes[1].turns["eyeLookUpRight"][0], abs=1e-5)
    assert np.abs(played.track("rotation", "LeftEye")[-1][:3]).max() == 0.0


def test_a_pose_that_the_file_was_saved_in_is_not_the_face_at_rest(folder: Path, shared: Callable[[str], Face]) -> None:
    plain = shared("plain")
    names = shipped_head().shape_names
    character = write_character_file(
        folder / "saved.glb", Variant(rename=lambda name: "Fatness" if name == "cheekPuff" else name)
    )
    root, binary = split_glb(character.read_bytes())
    saved = {"jawOpen": 0.4, "cheekPuff": 0.5}
    root["meshes"][0]["weights"] = [saved.get(name, 0.0) for name in names]
    character.write_bytes(glb(root, binary))
    fat = shipped_head().shapes[names.index("cheekPuff")] * 0.5
    fattened = replace(shipped_head(), vertices=(shipped_head().vertices + fat).astype(np.float32))
    result = import_face(character, landmarks=write_landmarks(folder / "fat.tsv", face=fattened))
    gaps = np.abs(result.face.vertices - result.face.vertices[0] - (plain.vertices - plain.vertices[0]))
    assert gaps.max() == pytest.approx(np.abs(fat - fat[0]).max(), abs=0.02)  # mm; the jaw alone would give 20
    assert any("poses 1 of the mapped shapes (jawOpen 0.40)" in note for note in result.report.notes)
    write_character(made_clip(result.face, {"mouthPucker": 0.3}), result.face, folder / "saved_out.glb")
    weights = {name: weight for name, weight in Played(folder / "saved_out.glb").weights().items() if weight}
    assert weights == {"mouthPucker": pytest.approx(0.3, abs=1e-6), "Fatness": pytest.approx(0.5, abs=1e-6)}


def test_motion_of_missing_shapes_is_carried_by_own_ones(folder: Path) -> None:
    face = imported(folder, "carried", Variant(dropped=frozenset({"browInnerUp"})))
    from tts2face.face.expressions import add_expression_shapes

    extended = add_expression_shapes(face)
    assert "browInnerUp" in extended.shape_names
    write_character(made_clip(extended, {"browInnerUp": 1.0}), extended, folder / "carried_out.glb")
    weights = {name: weight for name, weight in Played(folder / "carried_out.glb").weights().items() if weight > 0.05}
    assert min(weights["browOuterUpLeft"], weights["browOuterUpRight"]) > 0.2
    assert not [name for name in weights if name.startswith(("jaw", "mouth", "eyeLook"))]


def test_everything_else_of_the_file_is_kept(folder: Path) -> None:
    face = imported(folder, "kept", Variant(is_quantised=True))
    write_character(made_clip(face, {"jawOpen": 0.5}), face, folder / "kept_out.glb")
    before, binary = split_glb((folder / "kept.glb").read_bytes())
    after, longer = split_glb((folder / "kept_out.glb").read_bytes())
    assert "VRMC_vrm_animation" not in json.dumps(after)  # of a file that is no VRM
    for key in ("meshes", "materials", "images", "textures", "extensionsRequired"):
        assert after[key] == before[key]
    assert longer[: before["buffers"][0]["byteLength"]] == binary[: before["buffers"][0]["byteLength"]]
    (total,) = struct.unpack_from("<I", (folder / "kept_out.glb").read_bytes(), 8)
    assert total == (folder / "kept_out.glb").stat().st_size


def test_another_file_or_face_is_refused(folder: Path, shared: Callable[[str], Face]) -> None:
    face = shared("plain")
    clip = made_clip(face, {})
    with pytest.raises(InputError, match="not imported from a character's file"):
        write_character(clip, shipped_head(), folder / "x.glb")
    (folder / "other.glb").write_bytes((folder / "plain.glb").read_bytes() + b"\0")
    with pytest.raises(DataError, match=r"content of .* differs from the file from which the face was imported"):
        write_character(clip, face, folder / "x.glb", character=folder / "other.glb")
    with pytest.raises(DataError, match="there is no character"):
        write_character(clip, face, folder / "x.glb", character=folder / "none.glb")
    assert not (folder / "x.glb").exists()


def test_an_export_is_the_animated_character(tmp_path: Path) -> None:
    character = write_character_file(tmp_path / "character.glb")
    table = write_landmarks(tmp_path / "landmarks.tsv")
    face, out = tmp_path / "me.face", tmp_path / "spoken.glb"
    assert run(["face", "import", str(character), "--out", str(face), "--landmarks", str(table), "--quiet"]) == 0
    assert run(["Hello.", "--face", str(face), "--out", str(out), "--fps", "10", "--quiet"]) == 0
    assert max(Played(out).weights().values()) > 0.1
    assert out.with_suffix(".wav").stat().st_size > 10_000
    session = Session(face=str(face))
    written = write_character(session.clip("Hello.", fps=10), session.mesh, tmp_path / "same.glb")
    assert unmarked(written.path) == unmarked(out)  # a clip does not know its text
    before = character.read_bytes()
    assert run(["Hello.", "--face", str(face), "--out", str(character), "--fps", "10", "--quiet"]) == 2
    with pytest.raises(InputError, match="would replace the character"):
        write_character(session.clip("Hello.", fps=10), session.mesh, character)
    assert character.read_bytes() == before


def test_a_moved_character_is_found_again(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    character = write_character_file(tmp_path / "character.glb")
    table = write_landmarks(tmp_path / "landmarks.tsv")
    face, out, moved = tmp_path / "me.face", tmp_path / "spoken.glb", tmp_path / "elsewhere.glb"
    assert run(["face", "import", str(character), "--out", str(face), "--landmarks", str(table), "--quiet"]) == 0
    character.rename(moved)
    speak = ["Hello.", "--face", str(face), "--out", str(out), "--fps", "10", "--quiet"]
    assert run(speak) == 3
    assert "if it was moved, run `tts2face face relink FACE.face CHARACTER`" in capsys.readouterr().err
    before = read_face(face)
    assert run(["face", "relink", str(face), str(moved), "--quiet"]) == 0
    after = read_face(face)
    np.testing.assert_array_equal(before.textures[0].pixels, after.textures[0].pixels)
    np.testing.assert_array_equal(before.shapes, after.shapes)
    assert run(speak) == 0
    assert max(Played(out).weights().values()) > 0.1
    linked = face.read_bytes()
    moved.write_bytes(moved.read_bytes() + b"\0")
    assert run(["face", "relink", str(face), str(moved), "--quiet"]) == 3
    assert "differs from the file from which the face was imported" in capsys.readouterr().err
    assert run(["face", "relink", str(face), str(tmp_path / "none.glb"), "--quiet"]) == 3
    assert "none.glb; check the path" in capsys.readouterr().err
    assert run(["face", "relink", str(tmp_path / "no.face"), str(moved), "--quiet"]) == 2
    assert face.read_bytes() == linked


@pytest.mark.parametrize("name", ["plain", "skinned"])
def test_the_khronos_validator_finds_no_error(name: str, folder: Path, shared: Callable[[str], Face]) -> None:
    packages = programs.node_package("gltf-validator")
    face, out = shared(name), folder / f"{name}_out.glb"
    head = (0.1, 0.2, 0.0, 1.0, 0.0, 0.0)
    write_character(made_clip(face, {"jawOpen": 0.5, "eyeLookOutLeft": 0.5}, head=head), face, out)
    reports = [
        json.loads(programs.run_node(programs.VALIDATE, packages, str(path))) for path in (folder / f"{name}.glb", out)
    ]
    errors = [[m["code"] for m in report["issues"]["messages"] if m["severity"] == 0] for report in reports]
    assert errors == [[], []]
    assert reports[1]["info"]["animationCount"] == 1
