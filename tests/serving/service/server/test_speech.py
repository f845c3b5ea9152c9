"""OpenAI's own client, HeadTTS's own client, and clips, against a running service."""

import base64
import io
import json
import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

import av
import httpx
import numpy as np
import pytest

import tts2face
from tests.packages import package
from tests.running import RunningService

TEXT = "Hello there. This is a test."
NODE_MODULES = Path(os.environ.get("TTS2FACE_NODE_MODULES", "node_modules"))
HEADTTS = NODE_MODULES / "@met4citizen" / "headtts" / "modules" / "headtts.mjs"
HEADTTS_SCRIPT = """
globalThis.window = globalThis;
globalThis.location = {href: process.argv[2]};
globalThis.AudioContext = class { async decodeAudioData(bytes) { return bytes.byteLength; } };
const {HeadTTS} = await import(process.argv[3]);
const client = new HeadTTS({endpoints: [process.argv[2]], audioCtx: new AudioContext()});
await client.connect();
client.setup({voice: "af_bella", language: "en-us", speed: 1, audioEncoding: "wav"});
const answers = [
  ...await client.synthesize({input: "This is an example. And one more."}),
  ...await client.synthesize({input: ["We saw ", {type: "speech", value: "two hundred ", subtitles: ">199 "},
    {type: "phonetic", value: "\\u02c8\\u0254\\u0279\\u026an\\u02a4\\u0259z", subtitles: "oranges "},
    {type: "break", value: 700}, "on sale."]}),
];
console.log(JSON.stringify(answers));
process.exit(0);
"""


@pytest.fixture
def official(service: RunningService) -> Any:
    """OpenAI's client."""
    return package("openai").OpenAI(base_url=f"{service.url}/v1", api_key="unused", max_retries=0)


def samples(content: bytes) -> np.ndarray:
    with av.open(io.BytesIO(content)) as file:
        return np.concatenate([frame.to_ndarray().ravel() for frame in file.decode(audio=0)])


@pytest.mark.parametrize("format", ["mp3", "opus", "aac", "flac", "wav"])
def test_the_openai_client_streams_all_its_formats(official: Any, format: str) -> None:
    with official.audio.speech.with_streaming_response.create(
        model="gpt-4o-mini-tts", voice="coral", input=TEXT, response_format=format, speed=1.25, instructions="calm"
    ) as response:
        content = b"".join(response.iter_bytes())
    assert len(samples(content)) > 24_000


def test_the_openai_client_streams_events(official: Any) -> None:
    with official.audio.speech.with_streaming_response.create(
        model="tts-1", voice="alloy", input=TEXT, response_format="pcm", stream_format="sse"
    ) as response:
        events = [json.loads(line.removeprefix("data: ")) for line in response.iter_lines() if line]
    assert [event["type"] for event in events] == ["speech.audio.delta"] * 2 + ["speech.audio.done"]  # two sentences
    whole = official.audio.speech.create(model="tts-1", voice="alloy", input=TEXT, response_format="pcm").content
    assert b"".join(base64.b64decode(event["audio"]) for event in events[:-1]) == whole


def test_visemes_and_curves_as_lines(client: httpx.Client) -> None:
    body = {"input": TEXT, "voice": "alloy", "model": "tts-1"}
    lines = client.post("/v1/audio/speech", json=body | {"response_format": "oculus"}).text.splitlines()
    assert json.loads(lines[0])["viseme"] == "sil"
    head, *frames = map(
        json.loads, client.post("/v1/audio/speech", json=body | {"response_format": "jsonl"}).text.splitlines()
    )
    assert len(head["weights"]) == len(frames[0]["weights"]) == 52
    openings = [frame["weights"][head["weights"].index("jawOpen")] for frame in frames]
    assert max(openings) > 0.05 + min(openings)


def test_an_animated_mesh_is_that_of_python(client: httpx.Client, tmp_path: Path) -> None:
    session = tts2face.Session()
    path = tmp_path / "clip.glb"
    session.export(TEXT, path)
    body = {"input": TEXT, "voice": "alloy", "model": "tts-1", "response_format": "glb"}
    for answer in (
        client.post("/v1/audio/speech", json=body),
        client.post("/v1/clips", json={"text": TEXT, "format": "glb"}),
    ):
        assert answer.headers["content-type"].startswith("model/gltf-binary")
        assert answer.content == path.read_bytes()


def test_a_clip_arrives_while_it_is_made(client: httpx.Client) -> None:
    body = {"text": TEXT, "size": "64x64", "supersampling": 1, "identity": "kofi"}
    with client.stream("POST", "/v1/clips", json=body) as response:
        parts = list(response.iter_raw())
    assert response.headers["content-type"] == "video/mp4"
    assert len(parts) >= 3
    with av.open(io.BytesIO(b"".join(parts))) as movie:
        assert sum(1 for _ in movie.decode(video=0)) > 60
    with av.open(io.BytesIO(b"".join(parts[: len(parts) // 2]))) as movie:
        assert sum(1 for _ in movie.decode(video=0)) > 10


@pytest.mark.parametrize("scheme", ["http", "ws"])
def test_the_headtts_client_works_unchanged(service: RunningService, tmp_path: Path, scheme: str) -> None:
    node = shutil.which("node")
    if node is None or not HEADTTS.is_file():
        pytest.skip("Node and the npm package @met4citizen/headtts are not installed (TTS2FACE_NODE_MODULES)")
    script = tmp_path / "client.mjs"
    script.write_text(HEADTTS_SCRIPT)
    address = service.url.replace("http", scheme, 1) + ("/v1" if scheme == "http" else "/")
    done = subprocess.run(
        [node, "--experimental-websocket", str(script), address, str(HEADTTS.resolve())],
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    answers = json.loads(done.stdout.strip().splitlines()[-1])
    assert [answer["type"] for answer in answers] == ["audio", "audio", "audio"]
    first, _, mixed = (answer["data"] for answer in answers)
    assert first["words"] == ["This ", "is ", "an ", "example"]
    assert first["visemes"][:3] == ["TH", "I", "SS"]
    assert len(first["visemes"]) == len(first["vtimes"]) == len(first["vdurations"])
    assert first["wtimes"] == sorted(first["wtimes"])
    assert first["audio"] > 40_000
    assert mixed["words"] == ["We ", "saw ", ">199 ", "oranges ", "on ", "sale"]
    gap = mixed["wtimes"][4] - mixed["wtimes"][3] - mixed["wdurations"][3]
    assert gap == pytest.approx(700, abs=150)


def test_letters_of_a_phonetic_item_are_no_words(client: httpx.Client) -> None:
    """As HeadTTS, which shows the item's subtitles only."""
    item = {"type": "phonetic", "value": "ˈɔɹɪnʤəz"}
    answer = client.post("/v1/synthesize", json={"input": ["We saw ", item, "."]}).json()
    assert answer["words"] == ["We ", "saw ", ""]
    assert answer["wdurations"][2] > 200


def test_metrics_count_what_was_made(client: httpx.Client) -> None:
    def value(name: str) -> float:
        return next(
            float(line.split()[-1]) for line in client.get("/metrics").text.splitlines() if line.startswith(name)
        )

    before = value("tts2face_speech_seconds_total")
    client.post("/v1/audio/speech", json={"input": "Hello there.", "voice": "alloy", "model": "tts-1"})
    assert value("tts2face_speech_seconds_total") > before + 0.5
    assert value("tts2face_processes_ready") == 1
    assert client.get("/readyz").json()["status"] == "ready"
