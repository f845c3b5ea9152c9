"""Animation for VRM avatars: what the vowels do at the phones, what the file states, blinks, head and gaze."""

import json
from dataclasses import replace

import numpy as np
import pytest

import tts2face
from tests.interchange.characters.made import split_glb
from tests.interchange.exports import programs
from tests.interchange.exports.made import arkit_clip, turned_clip
from tts2face.interchange.exports.arkit import ARKIT_SHAPES, arkit_projection
from tts2face.interchange.exports.vowels import ROUNDED, UNROUNDED, blinks, vowel_projection
from tts2face.types import Clip, Trajectory

pytestmark = pytest.mark.formats


class Read:
    """A .vrma file: values of its nodes by the names of what they stand for."""

    def __init__(self, path):
        self.root, self.binary = split_glb(path.read_bytes())
        self.extension = self.root["extensions"]["VRMC_vrm_animation"]
        (self.animation,) = self.root["animations"]

    def rows(self, number):
        accessor = self.root["accessors"][number]
        width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[accessor["type"]]
        start = self.root["bufferViews"][accessor["bufferView"]]["byteOffset"]
        return np.frombuffer(self.binary, "<f4", accessor["count"] * width, start).reshape(-1, width)

    def track(self, node, path):
        channel = next(c for c in self.animation["channels"] if c["target"] == {"node": node, "path": path})
        return self.rows(self.animation["samplers"][channel["sampler"]]["output"])

    def expression(self, name):
        group = "preset" if name in self.extension["expressions"]["preset"] else "custom"
        return self.track(self.extension["expressions"][group][name]["node"], "translation")

    def bone(self, name):
        return self.track(self.extension["humanoid"]["humanBones"][name]["node"], "rotation")


def posed(**weights):
    """Weights (1, 52) of ARKit's shapes."""
    rows = np.zeros((1, len(ARKIT_SHAPES)))
    for name, weight in weights.items():
        rows[0, ARKIT_SHAPES.index(name)] = weight
    return rows


def of_pose(**weights):
    return {name: float(track[0]) for name, track in vowel_projection().weights(posed(**weights)).items()}


@pytest.mark.parametrize(
    ("pose", "vowel"),
    [
        ({"jawOpen": 0.6}, "aa"),
        ({"jawOpen": 0.3, "mouthFunnel": 0.5}, "oh"),
        ({"jawOpen": 0.1, "mouthPucker": 0.8}, "ou"),
        ({"jawOpen": 0.2, "mouthStretchLeft": 0.4, "mouthStretchRight": 0.4}, "ee"),
        ({"jawOpen": 0.06, "mouthStretchLeft": 0.4, "mouthStretchRight": 0.4}, "ih"),
    ],
)
def test_a_mouth_is_the_vowel_that_it_is_like(pose, vowel):
    found = of_pose(**pose)
    assert max(found, key=found.get) == vowel
    assert sum(found.values()) < 1.3


@pytest.mark.parametrize("pose", [{}, {"mouthSmileLeft": 0.3, "mouthSmileRight": 0.3, "mouthRollLower": 0.5},
                                  {"jawOpen": 0.2, "mouthClose": 0.6}, {"mouthPressLeft": 0.7, "mouthPressRight": 0.7},
                                  {"mouthPucker": 0.6, "mouthRollLower": 0.6, "mouthRollUpper": 0.6}])  # fmt: skip
def test_closed_lips_are_no_vowel(pose):
    assert sum(of_pose(**pose).values()) < 0.15


def test_spoken_lips_close_where_lips_meet_and_open_at_vowels():
    session = tts2face.Session(palette=None)
    clip = session.clip("Papa, mama, Bob.", gestures="none")
    weights = arkit_projection(clip.motion.channels, session.mesh, "x").weights(clip.motion.values).astype(float)
    total = np.sum([*vowel_projection().weights(weights).values()], axis=0)
    phones = zip(clip.speech.phones.phones, clip.speech.phones.edges, clip.speech.phones.edges[1:], strict=False)
    at = [(phone, total[int(begin * clip.fps) : int(end * clip.fps) + 1]) for phone, begin, end in phones]
    assert max(values.min() for phone, values in at if phone in "pbm") < 0.05
    assert min(values.max() for phone, values in at if phone in ("ɑ", "ɑː", "ɒ")) > 0.4


def test_no_lid_closes_twice():
    closed = blinks(np.vstack([posed(eyeBlinkLeft=0.9, eyeBlinkRight=0.4), posed(eyeBlinkRight=0.5)]))
    assert {name: track.tolist() for name, track in closed.items()} == {
        "blink": [0.4, 0.0], "blinkLeft": [0.5, 0.0], "blinkRight": [0.0, 0.5],
    }  # fmt: skip


@pytest.mark.parametrize(("channel", "axis"), [("pitch", 0), ("yaw", 1), ("roll", 2)])
def test_the_head_turns_as_in_other_exports(channel, axis, tmp_path):
    clip = turned_clip(4, channels=ARKIT_SHAPES, **{channel: np.radians(10.0)})
    tts2face.export(clip, tmp_path / "a.vrma")
    expected = np.zeros(4)
    expected[[axis, 3]] = np.sin(np.radians(5.0)), np.cos(np.radians(5.0))
    assert np.allclose(Read(tmp_path / "a.vrma").bone("head"), expected, rtol=0, atol=1e-6)


@pytest.mark.parametrize(
    ("gaze", "axis", "sign"),
    [
        (("eyeLookDownLeft", "eyeLookDownRight"), 0, 1), (("eyeLookUpLeft", "eyeLookUpRight"), 0, -1),
        (("eyeLookOutLeft", "eyeLookInRight"), 1, 1), (("eyeLookInLeft", "eyeLookOutRight"), 1, -1),
    ],
)  # fmt: skip
@pytest.mark.parametrize("with_face", [True, False])
def test_gaze_turns_down_about_x_and_to_its_left_about_y(gaze, axis, sign, with_face, tmp_path):
    face = tts2face.load_face("head") if with_face else None
    channels = face.shape_names if face else ARKIT_SHAPES
    clip = turned_clip(3, channels=channels)
    values = np.zeros_like(clip.motion.values)
    values[:, [channels.index(name) for name in gaze]] = 0.8
    tts2face.export(
        Clip(Trajectory(channels, values, clip.fps), clip.head, clip.speech), tmp_path / "a.vrma", face=face
    )
    file = Read(tmp_path / "a.vrma")
    turn = file.track(file.extension["lookAt"]["node"], "rotation")[-1]
    assert sign * turn[axis] > 0.1
    assert abs(turn[1 - axis]) < 0.03


def test_weights_are_limited_and_keys_end_with_the_sound(tmp_path):
    clip = arkit_clip(30)
    wide = replace(clip, motion=Trajectory(ARKIT_SHAPES, 3 * clip.motion.values, clip.fps))
    tts2face.export(wide, tmp_path / "a.vrma", fps=30)
    file = Read(tmp_path / "a.vrma")
    for name in (*UNROUNDED, ROUNDED, "blink", "blinkLeft", "blinkRight"):
        rows = file.expression(name)
        assert not rows[:, 1:].any()
        assert rows.min() >= 0.0
        assert rows.max() <= 1.0
    times = file.rows(file.animation["samplers"][0]["input"])[:, 0]
    assert times[-1] == pytest.approx(clip.speech.waveform.duration, abs=1e-6)
    assert {sampler["interpolation"] for sampler in file.animation["samplers"]} == {"LINEAR"}
    assert file.root["asset"]["extras"]["sound"] == "a.wav"
    assert (tmp_path / "a.wav").exists()


def test_the_khronos_validator_finds_no_error(tmp_path):
    packages = programs.node_package("gltf-validator")
    tts2face.export(arkit_clip(20), tmp_path / "a.vrma")
    report = json.loads(programs.run_node(programs.VALIDATE, packages, str(tmp_path / "a.vrma")))
    assert (report["issues"]["numErrors"], report["issues"]["numWarnings"]) == (0, 0), report["issues"]["messages"]


def test_a_session_sends_the_same_file():
    session = tts2face.Session(palette=None)
    content = b"".join(chunk.content for chunk in session.stream_file("Hi.", "vrma", gestures="none"))
    root, _ = split_glb(content)
    assert {*root["extensions"]["VRMC_vrm_animation"]["expressions"]["preset"]} >= {*UNROUNDED, ROUNDED, "blink"}
    assert len(root["animations"]) == 1
