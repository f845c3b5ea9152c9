"""Modules of the element <tts2face-head> in Node: curves, the clock of the sound, the connection, samples."""

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

import tts2face
from tts2face.interchange.characters.bone_tracks import NECK_SHARE
from tts2face.interchange.gltf.nodes import _BONE_NAMES
from tts2face.serving.service import page_addresses

FOLDER = Path(tts2face.__file__).parent / "serving/service/browser"
CURVES = """
const { CurveTrack } = await use("curves.js");
const track = new CurveTrack(), row = (jaw) => [jaw, 0];
const add = (begin, jaws) => track.add({begin, fps: 10, names: ["jaw", "lip"], head_names: ["yaw"],
  weights: jaws.map(row), head: jaws.map((jaw) => [-jaw])});
"""
CLOCK = """
globalThis.page = 5;
globalThis.performance = {now: () => 1000 * page};
const sources = [];
globalThis.AudioContext = class {
  currentTime = 0; state = "suspended"; outputLatency = 0.5; sampleRate = 48000; destination = null;
  createBuffer(_, n, rate) { return {duration: n / rate, copyToChannel() {}}; }
  createBufferSource() {
    const source = {connect() {}, disconnect() {}, stop() { this.ended = true; }, start(...at) { this.at = at; }};
    sources.push(source);
    return source;
  }
  resume() { this.state = "running"; this.onstatechange(); }
};
const { SoundClock } = await use("sound_clock.js");
const clock = new SoundClock();
"""
SOCKET = """
const sockets = [], events = [], timers = [];
globalThis.setTimeout = (call, ms) => (timers.push(ms), call());
globalThis.clearTimeout = () => {};
globalThis.WebSocket = class {
  static OPEN = 1;
  sent = []; readyState = 0;
  constructor(url, protocols) { Object.assign(this, {url: String(url), protocols}); sockets.push(this); }
  send(content) { this.sent.push(typeof content === "string" ? JSON.parse(content) : content.length); }
  close() { this.closed = true; }
  open() { this.readyState = 1; this.onopen(); }
};
Math.random = () => 0.5;
const { LiveStream } = await use("live_stream.js");
const settled = async () => { for (let n = 0; n < 20; n++) await null; };
const stream = new LiveStream("https://there.example:1/x", KEY, {face: "own"}, (event) => events.push(event));
await settled();
"""


def run(script: str) -> Any:
    """What the last line of a script, `return ...`, returns; `use` imports a module of the element."""
    if shutil.which("node") is None:
        pytest.skip("node is not installed")
    use = f"const use = (name) => import({json.dumps(FOLDER.as_uri())} + '/' + name);"
    whole = f"{use}(async () => {{{script}}})().then((found) => process.stdout.write(JSON.stringify(found)))"
    done = subprocess.run(["node", "-e", whole], capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_poses_lie_between_two_frames() -> None:
    found = run(
        CURVES
        + """add(0, [0, 1]); add(0.2, [0.5]); track.origin = 100;
    return [99.9, 100, 100.05, 100.15, 101].map((now) => track.at(now));"""
    )
    assert found[0] is None
    assert [one["weights"][0] for one in found[1:]] == pytest.approx([0, 0.5, 0.75, 0.5])
    assert [one["head"][0] for one in found[1:]] == pytest.approx([0, -0.5, -0.75, -0.5])


def test_a_join_fades_from_the_last_pose_and_a_cleared_track_comes_to_rest() -> None:
    found = run(
        CURVES
        + """add(0, [1, 1]); track.origin = 0; track.at(0.1);
    track.clear(0.1);
    const rest = [0.1, 0.175, 0.4].map((now) => track.at(now));
    add(7, [1, 1, 1, 1, 1, 1, 1, 1, 1]); track.origin = 0.45 - 7;
    return [...rest, ...[0.5, 0.65, 0.9].map((now) => track.at(now))];"""
    )
    jaws = [one["weights"][0] for one in found]
    assert jaws[:3] == pytest.approx([1, 0.5, 0])
    assert 0 == jaws[3] < jaws[4] < jaws[5] == 1
    assert found[2]["head"] == [-1]  # the head stays where it is


def test_sound_is_placed_on_the_clock_and_begins_where_it_is_when_it_may_be_heard() -> None:
    found = run(
        CLOCK
        + """
    clock.play(new Float32Array(48000), 48000, 6);
    const silent = [clock.isSounding, sources.length, clock.now];
    page = 6.25;
    clock.context.currentTime = 1;
    clock.context.resume();
    const began = [clock.now, ...sources[0].at];
    clock.context.currentTime = 2;
    page = 100;
    const piece = clock.play(new Float32Array(480), 48000, 8);
    clock.move(piece, 9);
    clock.stop(piece);
    clock.play(new Float32Array(480), 48000, 3);
    return {silent, began, now: clock.now, next: sources.slice(1).map((one) => [...one.at, one.ended ?? false])};"""
    )
    assert found["silent"] == [False, 0, 5]
    # heard a half second after it is given: sample 0 at 6 would have been given at 5.5, which is 0.25 + 0.5 s ago
    assert found["began"] == pytest.approx([6.25, 0.25, 0.75])
    assert found["now"] == pytest.approx(7.25)
    assert found["next"] == [[pytest.approx(2.25), 0, True], [pytest.approx(3.25), 0, True]]


def test_keys_stand_in_no_address_and_lost_connections_are_opened_again() -> None:
    found = run(
        SOCKET.replace("KEY", "async () => 'secret'")
        + """
    stream.send({type: "text", text: "a"}); stream.send(new Int16Array(3));
    sockets[0].open();
    sockets[0].onmessage({data: JSON.stringify({type: "speech"})});
    sockets[0].onmessage({data: new Int16Array([1, 2]).buffer});
    sockets[0].onclose({code: 1012, reason: "restart"});
    await settled();
    sockets[1].open();
    sockets[1].onclose({code: 1006, reason: ""});
    await settled();
    sockets[2].onclose({code: 1008, reason: "the key has been removed"});
    await settled();
    return {sockets, events, timers};"""
    )
    sockets = found["sockets"]
    assert [one["url"] for one in sockets] == ["wss://there.example:1/v1/stream"] * 3
    assert all(one["protocols"] == ["tts2face", "tts2face.key.secret"] for one in sockets)
    start = {"type": "start", "face": "own"}
    assert [one["sent"] for one in sockets] == [[start, {"type": "text", "text": "a"}, 3], [start], []]
    assert found["timers"] == [500, 1000]  # ms
    assert [one.get("state", one["type"]) for one in found["events"]] == [
        "open", "speech", "sound", "lost", "open", "lost", "refused",
    ]  # fmt: skip
    assert found["events"][3]["reason"] == "restart"
    assert found["events"][-1]["reason"] == "the key has been removed"


def test_without_a_key_no_subprotocol_is_offered() -> None:
    assert run(SOCKET.replace("KEY", "null") + "return sockets[0].protocols;") == []


def test_sound_of_every_form_becomes_16_bit_samples() -> None:
    found = run(
        """const { shorts, Resampler, floats } = await use("samples.js");
    const forms = [new Int16Array([5]), new Float32Array([0.5, -2]), new Int16Array([7, 8]).buffer,
      new Uint8Array([1, 0, 2, 0])];
    let wrong; try { shorts([1]); } catch (error) { wrong = error.message; }
    const whole = Float32Array.from({length: 240}, (_, n) => n), parts = new Resampler(24000, 48000);
    const made = [];
    for (let at = 0; at < 240; at += 7) made.push(...parts.add(whole.slice(at, at + 7)));
    return {forms: forms.map((one) => [...shorts(one)]), wrong, made, floats: [...floats(new Int16Array([16384]))]};"""
    )
    assert found["forms"] == [[5], [16384, -32767], [7, 8], [1, 2]]
    assert found["wrong"].startswith("sound must be an Int16Array")
    assert found["made"] == pytest.approx([n / 2 for n in range(len(found["made"]))])  # without a seam
    assert len(found["made"]) >= 476
    assert found["floats"] == [0.5]


def test_the_package_has_the_modules_that_the_service_sends() -> None:
    about = json.loads((FOLDER / "package.json").read_text())
    assert about["version"] == tts2face.__version__
    assert {path.name for path in FOLDER.glob("*.js")} == set(page_addresses.BROWSER_FILES)
    if shutil.which("npm") is None:
        pytest.skip("npm is not installed")
    packed = subprocess.run(
        ["npm", "pack", "--dry-run", "--json", "--offline"], cwd=FOLDER, capture_output=True, text=True, check=True
    )
    names = {file["path"] for file in json.loads(packed.stdout)[0]["files"]}
    assert names == {*page_addresses.BROWSER_FILES, "package.json", "README.md", "tts2face-head.d.ts"}


def test_bones_are_found_as_by_the_exports() -> None:
    source = (FOLDER / "puppet.js").read_text()
    for bone, pattern in _BONE_NAMES.items():
        assert f"{bone}: /{pattern.pattern}/i," in source
    assert f"const NECK_SHARE = {NECK_SHARE};" in source
