"""The programs of docs/examples run as their docstrings say, and make what they promise."""

import csv
import json
import re
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import av
import numpy as np
import pygltflib
import pytest

import tts2face
from tests.docs.programs import install, prepare_example, run
from tests.interchange.exports.made import signed_clip, with_gesture
from tests.rendered_takes import NAMES
from tts2face.types import frame_count


def run_example(name: str, folder: Path) -> str:
    """What a program prints that is started by the last command line of its docstring."""
    ended = run(prepare_example(name, folder)[-1], folder)
    assert ended.returncode == 0, ended.stderr
    return ended.stdout


def csv_rows(path: Path) -> list[list[str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.reader(file))


def n_pictures(path: Path) -> int:
    with av.open(str(path)) as film:
        return sum(1 for _ in film.decode(video=0))


def test_a_clip(tmp_path: Path) -> None:
    printed = run_example("clip", tmp_path)
    n_frames = n_pictures(tmp_path / "hello.mp4")
    assert f"{n_frames} frames" in printed
    n_rows = len(csv_rows(tmp_path / "hello.csv")) - 1
    assert n_rows in {2 * n_frames - 1, 2 * n_frames}  # Live Link Face has 60 frames a second, not 30
    sentences = re.findall(r"^[A-Z].*$", (tmp_path / "hello.srt").read_text(), re.MULTILINE)
    assert sentences == ["Hello there.", "We were away a year ago.", "Good bye."]
    words = re.findall(r"^ *([\d.]+) s  (\w+) +(\S.*)$", printed, re.MULTILINE)
    assert [word for _, word, _ in words] == ["Hello", "there", "We", "were", "away", "a", "year", "ago", "Good", "bye"]
    assert words[-1][2] == "b aɪ"
    times = [float(time) for time, _, _ in words]
    assert times == sorted(times)


FBX_SCRIPT = """
import json, sys
import bpy
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.wm.fbx_import(filepath=sys.argv[1])
keys = next(keys for keys in bpy.data.shape_keys if "jawOpen" in keys.key_blocks)
weights = []
for frame in range(1, 1 + int(sys.argv[2])):
    bpy.context.scene.frame_set(frame)
    weights.append(keys.key_blocks["jawOpen"].value)
print("ANSWER" + json.dumps({"weights": weights, "rate": bpy.context.scene.render.fps}))
"""


def played(path: Path, n_frames: int) -> dict[str, object]:
    """Weights of jawOpen in frames of an .fbx file that Blender reads, and its frame rate."""
    command = [sys.executable, "-c", FBX_SCRIPT, str(path), str(n_frames)]
    printed = subprocess.run(command, capture_output=True, text=True, check=True, timeout=120).stdout
    return dict(json.loads(next(line for line in printed.splitlines() if line.startswith("ANSWER"))[6:]))


@pytest.mark.skipif(find_spec("bpy") is None, reason="Blender's package bpy is not installed")
@pytest.mark.parametrize("has_head", [True, False])
def test_a_clip_becomes_fbx_and_an_fbx_a_character(tmp_path: Path, has_head: bool) -> None:
    clip = signed_clip(25, face := with_gesture())
    tts2face.export(clip, tmp_path / "clip.glb", face=face, fps=25)
    if not has_head:
        content = pygltflib.GLTF2().load(tmp_path / "clip.glb")
        animation = content.animations[0]
        animation.channels = [one for one in animation.channels if one.target.path == "weights"]
        content.save(tmp_path / "clip.glb")
    assert "at 25 frames a second" in run_example("glb_to_fbx", tmp_path)
    expected = tts2face.export(clip, tmp_path / "clip.npz", face=face, fps=25) and np.load(tmp_path / "clip.npz")
    weights = expected["motion"][:, face.shape_names.index("jawOpen")]
    answer = played(tmp_path / "clip.fbx", len(weights))
    assert answer["rate"] == 25
    assert np.allclose(answer["weights"], weights, rtol=0, atol=1e-3)
    (tmp_path / "clip.fbx").rename(tmp_path / "character.fbx")
    assert "6 shapes: " in run_example("fbx_to_glb", tmp_path)
    made = pygltflib.GLTF2().load(tmp_path / "character.glb")
    mesh = next(mesh for mesh in made.meshes if mesh.primitives[0].targets)
    assert set(mesh.extras["targetNames"]) == {*face.shape_names, "brows0Minus"}
    assert not any(mesh.weights)
    assert not made.animations
    assert len(made.images) == 1


def test_a_batch_renders_what_has_changed(tmp_path: Path) -> None:
    assert "2 clips made, 0 unchanged, 0 failed" in run_example("subtitles", tmp_path)
    for name in ("talk-0001", "talk-0002"):
        n_frames = n_pictures(tmp_path / "clips" / f"{name}.mp4")
        assert n_frames >= 1.5 * 25  # the time of its cue
        assert len(csv_rows(tmp_path / "clips" / f"{name}.csv")) == 1 + frame_count(n_frames / 25, 60)
    subtitles = tmp_path / "talk.srt"
    subtitles.write_text(subtitles.read_text().replace("How are you?", "Who are you?"))
    again = run("python subtitles.py talk.srt", tmp_path)
    assert "1 clips made, 1 unchanged, 0 failed" in again.stdout, again.stderr
    assert "talk-0002.mp4 done JOHN: Who are you?" in again.stdout


def test_an_export_format(tmp_path: Path) -> None:
    *_, command = prepare_example("export_format", tmp_path)
    environment = install(tmp_path, tmp_path / "installed")
    command = command.replace("We were away a year ago.", "Bob may move five big maps.")
    ended = run(command, tmp_path, "--export", "away.track.json", environment=environment)
    assert ended.returncode == 0, ended.stderr
    head, *lines = (tmp_path / "away.moho.dat").read_text().splitlines()
    assert head == "MohoSwitch1"
    changes = [(int(frame), shape) for frame, shape in (line.split() for line in lines)]
    assert changes[0] == (1, "rest")
    phones = tts2face.load_clip(tmp_path / "away.track.json").speech.phones
    starts = [start for phone, start in zip(phones.phones, phones.edges, strict=False) if phone in "pbm"]
    shapes = [[shape for frame, shape in changes if frame <= round(start * 24) + 1][-1] for start in starts]
    assert shapes == ["MBP"] * 7


def test_a_voice(tmp_path: Path) -> None:
    *_, command = prepare_example("own_voice", tmp_path)
    environment = dict(install(tmp_path, tmp_path / "installed"))
    program = f"{sys.executable} -m tts2face {{text}} --voice espeak --rate 0.8 --plain-delivery --out {{out}}"
    small = ("--size", "64x64", "--fps", "10", "--export", "away.track.json")
    ended = run(command, tmp_path, *small, environment=environment | {"VOICE_COMMAND": program})
    assert ended.returncode == 0, ended.stderr
    speech = tts2face.load_clip(tmp_path / "away.track.json").speech
    assert [word.text for word in speech.words] == ["We", "were", "away", "a", "year", "ago"]
    assert n_pictures(tmp_path / "away.mp4") == frame_count(speech.waveform.duration, 10)
    refused = run(command, tmp_path, environment=environment | {"VOICE_COMMAND": "absent {text} {out}"})
    assert refused.returncode == 4
    assert "the voice's program failed ([Errno 2]" in refused.stderr


@pytest.mark.needs("matplotlib", "sklearn")
def test_a_table_of_similarities(tmp_path: Path) -> None:
    printed = run_example("phone_similarity", tmp_path)
    (_, _, *phones), *rows = csv_rows(tmp_path / "similarity.csv")
    table = np.array([row[2:] for row in rows], float)
    np.testing.assert_array_equal(table, table.T)
    np.testing.assert_array_equal(np.diag(table), 1.0)
    nearest = {phone: phones[np.argsort(row)[-2]] for phone, row in zip(phones, table, strict=True)}
    assert (nearest["p"], nearest["f"]) == ("b", "θ")
    assert all(re.search(rf"^{phone} .*  {other} 0", printed, re.MULTILINE) for phone, other in nearest.items())
    visemes = re.findall(r"^viseme \d: (.*)$", printed, re.MULTILINE)
    assert sorted(" ".join(visemes).split()) == sorted(phones)
    assert len(visemes) == 6
    assert "<svg" in (tmp_path / "similarity.html").read_text()


def test_an_evaluation(rendered_takes: Path, face_model: Path, tmp_path: Path) -> None:
    (tmp_path / "recordings").symlink_to(rendered_takes)
    printed = run_example("evaluate_recordings", tmp_path)
    assert f"{len(NAMES) - 2} utterances to learn from" in printed
    opening = {name.strip(): float(value) for name, value in re.findall(r"^(.+?) +opening (-?[\d.]+)", printed, re.M)}
    assert opening["mean face"] < opening["mean phone pose"] < opening["exemplar"] <= opening["real, through the model"]
    assert "<svg" in (tmp_path / "evaluation.html").read_text()
