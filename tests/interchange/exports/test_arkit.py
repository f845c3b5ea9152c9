"""ARKit weights: read back by our reader, by OpenFaceFX and by csv and json; units, timecodes, and gestures."""

import csv
import json
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

import tts2face
from lexicon.errors import InputError
from tests.interchange.exports.made import arkit_clip, made_clip, made_stream, turned_clip
from tests.packages import package
from tests.picture.tiny_face import tiny_face
from tts2face.face.shape_transfer import append_shapes
from tts2face.interchange.exports.arkit import ARKIT_SHAPES, arkit_projection, build_arkit_projection
from tts2face.interchange.exports.livelink import eye_angles, timecode
from tts2face.interchange.exports.parts import Target
from tts2face.models.face_loading import load_face
from tts2face.types import Clip, Trajectory
from tts2face.video.livelink import read_livelink

pytestmark = pytest.mark.formats

STEP = 0.6e-6  # half of the last of six decimals, and rounding to 32 bits


def table(path):
    with path.open(newline="") as file:
        return list(csv.reader(file))


def test_the_shapes_are_those_of_the_default_head():
    assert len(set(ARKIT_SHAPES)) == 52
    assert set(load_face("head").shape_names) == {*ARKIT_SHAPES, "tongueUp"}


def test_our_reader_gives_back_weights_and_head(tmp_path):
    clip = arkit_clip(150)
    tts2face.export(clip, tmp_path / "a.csv")
    read = read_livelink(tmp_path / "a.csv")
    assert read.weights.fps == 60.0
    assert read.weights.channels == ARKIT_SHAPES
    assert np.allclose(read.weights.values, clip.motion.values, rtol=0, atol=STEP)
    turns = clip.head.values[:, :3]
    assert np.allclose(read.head.values[:, :3], turns - np.median(turns, axis=0), rtol=0, atol=2 * STEP)


@pytest.mark.parametrize("fps", [24.0, 25.0, 30000 / 1001, 30.0, 48.0, 60.0, 120.0])
def test_rows_are_at_the_times_of_frames(fps, tmp_path):
    clip = arkit_clip(180, fps)
    tts2face.export(clip, tmp_path / "a.csv", fps=fps)
    rows = table(tmp_path / "a.csv")
    assert len(rows) == 181
    base = int(fps) if fps in (24, 25, 30, 60, 120) else 60
    for number, row in enumerate(rows[1:]):
        hours, minutes, seconds, frames = row[0].split(":")
        time = int(hours) * 3600 + int(minutes) * 60 + int(seconds) + float(frames) / base
        assert time == pytest.approx(number / fps, abs=0.6e-3 / base)
    assert read_livelink(tmp_path / "a.csv").weights.fps == pytest.approx(fps, abs=1e-9)


def test_captures_have_60_frames_a_second_by_default(tmp_path):
    tts2face.export(arkit_clip(60, 30.0), tmp_path / "a.csv")
    read = read_livelink(tmp_path / "a.csv").weights
    assert (len(read), read.fps) == (120, 60.0)
    expected = arkit_clip(60, 30.0).motion.values
    assert np.allclose(read.values[:-1:2], expected, rtol=0, atol=STEP)
    assert np.allclose(read.values[1:-1:2], (expected[:-1] + expected[1:]) / 2, rtol=0, atol=STEP + 1e-7)


def test_openfacefx_reads_the_same_names_and_times(tmp_path):
    importers = package("openfacefx.importers_csv")
    clip = arkit_clip(120)
    tts2face.export(clip, tmp_path / "a.csv")
    track, _ = importers.read_csv(str(tmp_path / "a.csv"), epsilon=0.0)
    values = {channel.name: channel for channel in track.channels}
    for column, name in enumerate(ARKIT_SHAPES):
        keys = values[name[0].upper() + name[1:]].keys
        times, weights = np.array([(key.time, key.value) for key in keys]).T
        assert times[-1] == pytest.approx(119 / 60, abs=1e-4)
        read = np.interp(np.arange(120) / 60, times, weights)
        assert np.allclose(read, clip.motion.values[:, column], rtol=0, atol=1e-3)  # it keeps four decimals


def test_openfacefx_has_the_same_columns(tmp_path):
    writer = package("openfacefx.export_livelink")
    tts2face.export(arkit_clip(2), tmp_path / "a.csv")
    heading = table(tmp_path / "a.csv")[0]
    assert heading[:2] == ["Timecode", "BlendshapeCount"]
    assert sorted(heading[2:]) == sorted(writer.LIVELINK_COLUMNS)


def test_a_recorded_capture_has_the_same_columns_and_relation_of_eyes(shared_recordings, tmp_path):
    recorded = table(shared_recordings / "livelink" / "testset_arkit61_60fps.csv")
    tts2face.export(arkit_clip(2), tmp_path / "a.csv")
    heading = table(tmp_path / "a.csv")[0]
    assert heading == recorded[0]
    values = np.array([row[2:] for row in recorded[1:]], np.float32)
    for side in ("Left", "Right"):
        angles = eye_angles(values[:, :52], side)
        shown = values[:, [heading.index(f"{side}Eye{angle}") - 2 for angle in ("Yaw", "Pitch")]]
        for column in range(2):
            slope = np.polyfit(angles[:, column], shown[:, column], 1)[0]
            assert slope == pytest.approx(1.0, abs=0.1)


def test_head_and_eyes_are_in_radians(tmp_path):
    ten = np.radians(10.0)
    clip = turned_clip(120, 60.0, channels=ARKIT_SHAPES, pitch=ten, yaw=2 * ten, roll=3 * ten)
    motion = np.zeros((120, 52), np.float32)
    motion[:, ARKIT_SHAPES.index("eyeLookDownLeft")] = 0.5
    motion[:, ARKIT_SHAPES.index("eyeLookInLeft")] = 1.0
    motion[:, ARKIT_SHAPES.index("eyeLookOutRight")] = 1.0
    tts2face.export(Clip(Trajectory(ARKIT_SHAPES, motion, 60.0), clip.head, clip.speech), tmp_path / "a.csv")
    heading, first, *_ = table(tmp_path / "a.csv")
    row = dict(zip(heading, first, strict=True))
    assert row["BlendshapeCount"] == "61"
    expected = {
        "HeadPitch": ten, "HeadYaw": -2 * ten, "HeadRoll": 3 * ten, "LeftEyePitch": 0.25, "LeftEyeYaw": 0.64,
        "LeftEyeRoll": 0, "RightEyePitch": 0, "RightEyeYaw": 0.64, "RightEyeRoll": 0,
    }  # fmt: skip
    for name, radians in expected.items():
        assert float(row[name]) == pytest.approx(radians, abs=STEP), name


def test_timecodes():
    assert timecode(0, Fraction(60)) == "00:00:00:00.000"
    assert timecode(60 * 3600 * 25 + 59, Fraction(60)) == "25:00:00:59.000"
    assert timecode(1, Fraction(30000, 1001)) == "00:00:00:02.002"
    assert timecode(1, Fraction(12)) == "00:00:00:05.000"


def test_audio2face_json(tmp_path):
    clip = arkit_clip(40, 30.0)
    tts2face.export(clip, tmp_path / "a.a2f.json")
    content = json.loads((tmp_path / "a.a2f.json").read_text())
    assert (content["exportFps"], content["numFrames"], content["numPoses"]) == (30.0, 40, 52)
    assert content["facsNames"] == list(ARKIT_SHAPES)
    assert np.allclose(content["weightMat"], clip.motion.values, rtol=1e-5, atol=1e-6)
    reader = package("openfacefx.export_a2f")
    track, warnings = reader.read_a2f(str(tmp_path / "a.a2f.json"))
    assert not warnings
    assert track.fps == 30.0
    assert {channel.name for channel in track.channels} == set(ARKIT_SHAPES)


def test_shapes_that_the_face_lacks_are_0(tmp_path):
    clip = made_clip(20, 60.0, ("jawOpen", "mouthSmileLeft"))
    tts2face.export(clip, tmp_path / "a.a2f.json")
    weights = np.array(json.loads((tmp_path / "a.a2f.json").read_text())["weightMat"])
    used = [ARKIT_SHAPES.index(name) for name in clip.motion.channels]
    assert np.allclose(weights[:, used], clip.motion.values, rtol=1e-5, atol=1e-6)
    assert not np.delete(weights, used, axis=1).any()


def _face_with_gestures():
    """A face with two brow shapes, of which the channel ``brows0`` moves 0.3 and 0.1 for each unit."""
    face = tiny_face()
    chance = np.random.default_rng(3)
    brows = chance.normal(size=(2, *face.vertices.shape)).astype(np.float32)
    limits = np.array([[0.0, 1.0]] * 2, np.float32)
    face = append_shapes(face, ("browInnerUp", "browDownLeft"), brows, limits)
    mode = (0.3 * brows[:1] + 0.1 * brows[1:]).astype(np.float32)
    return append_shapes(face, ("brows0",), mode, np.array([[-9.0, 9.0]], np.float32))


def test_gestures_become_the_brow_shapes_that_move_the_same_way():
    face = _face_with_gestures()
    names = face.shape_names
    target = Target(None, "a.csv", Fraction(30), Fraction(30), 16_000, names, face)
    motion = np.zeros((3, len(names)), np.float32)
    motion[:, names.index("brows0")] = [0.0, 1.0, 9.0]
    motion[:, names.index("jawOpen")] = 0.5
    motion[:, names.index("browInnerUp")] = 0.1
    weights = build_arkit_projection(target).weights(motion)
    inner, down, jaw = (weights[:, ARKIT_SHAPES.index(name)] for name in ("browInnerUp", "browDownLeft", "jawOpen"))
    assert np.allclose(inner[:2], [0.1, 0.4], rtol=0, atol=2e-3)  # the ridge
    assert np.allclose(down[:2], [0.0, 0.1], rtol=0, atol=2e-3)
    assert np.array_equal(jaw, [0.5, 0.5, 0.5])
    assert weights.max() <= 1.0
    assert inner[2] == 1.0  # 2.8 is beyond the limit


def test_clips_of_a_face_share_the_inner_products_of_its_shapes():
    face = _face_with_gestures()
    target = Target(None, "a.csv", Fraction(30), Fraction(30), 16_000, face.shape_names, face)
    first, second = build_arkit_projection(target), build_arkit_projection(target)
    assert first.parts[0].curvature is second.parts[0].curvature
    assert first.parts[0].cross is second.parts[0].cross
    renamed = replace(target, channels=(*face.shape_names[:-1], "brows1"))
    assert build_arkit_projection(renamed).parts[0].cross is not first.parts[0].cross


def test_a_stream_of_captures_is_continuous(tmp_path):
    tts2face.export(made_stream(3, 20, 30.0, ARKIT_SHAPES), tmp_path / "a.csv")
    read = read_livelink(tmp_path / "a.csv").weights
    assert len(read) == 120


VISEMES = {"jawOpen": "mouthViseme_aa", "mouthFunnel": "mouthViseme_oh", "mouthPucker": "mouthViseme_ou"}


@pytest.mark.parametrize("keeps_others", [True, False])
def test_visemes_are_expressed_by_jaw_and_lips(keeps_others):
    head = load_face("head")
    rows = [at for at, name in enumerate(head.shape_names) if name in VISEMES or (keeps_others and "mouth" not in name)]
    names = tuple(VISEMES.get(head.shape_names[at], head.shape_names[at]) for at in rows)
    face = replace(
        head,
        shape_names=names,
        shapes=head.shapes[rows],
        limits=head.limits[rows],
        eyes=(),
        scores=None,
        occlusion=None,
    )
    motion = np.zeros((6, len(names)), np.float32)
    for shape, viseme in enumerate(VISEMES.values()):
        motion[2 * shape : 2 * shape + 2, names.index(viseme)] = (0.2, 0.4)
    weights = arkit_projection(names, face, "a.csv").weights(motion)
    for shape, own in enumerate(VISEMES):
        found = weights[2 * shape : 2 * shape + 2, ARKIT_SHAPES.index(own)]
        assert found == pytest.approx([0.2, 0.4], abs=0.12)
        others = np.delete(weights[2 * shape + 1], ARKIT_SHAPES.index(own))
        assert others.max() < 0.17
    assert weights[:2, ARKIT_SHAPES.index("jawOpen")] == pytest.approx([0.2, 0.4], abs=0.03)


def test_visemes_without_the_face_are_refused():
    with pytest.raises(InputError, match="has none of them"):
        arkit_projection(("mouthViseme_aa",), None, "a.csv")
