"""What programs for OpenAI and Kokoro-FastAPI ask for: published clients, and the documented requests of others."""

import base64
import io
import json
import os
import subprocess
from itertools import pairwise
from typing import Any

import av
import httpx
import numpy as np
import pytest

from tests.interchange.exports.programs import node_package
from tests.packages import package
from tests.running import RunningService

TEXT = "Hello there. This is a test."
ADJUSTED = "x-tts2face-adjusted"
NODE_CLIENT = """
const OpenAI = require("openai");
const client = new OpenAI({baseURL: process.argv[1] + "/v1", apiKey: "unused", maxRetries: 0});
(async () => {
  const speech = {model: "kokoro", voice: "af_bella", input: "Hello there.", response_format: "wav", speed: 4};
  const answer = await client.audio.speech.create(speech);
  const models = [];
  for await (const one of client.models.list()) models.push(one.id);
  let refused = "";
  try { await client.audio.speech.create({...speech, voice: "nobody"}); } catch (error) { refused = error.message; }
  console.log(JSON.stringify({
    bytes: (await answer.arrayBuffer()).byteLength, adjusted: answer.headers.get("x-tts2face-adjusted"), models,
    model: (await client.models.retrieve("tts-1-hd")).id, refused,
  }));
})();
"""
KOKORO = {  # the documented request of Kokoro-FastAPI with all its fields
    "model": "kokoro", "input": TEXT, "voice": "af_bella(2)+af_sky(1)", "response_format": "mp3", "speed": 1.0,
    "stream": True, "return_download_link": False, "lang_code": "a", "volume_multiplier": 1.0,
    "normalization_options": {"normalize": True, "unit_normalization": False},
}  # fmt: skip
TIMED = {
    "en-us": TEXT, "en-gb": TEXT, "de": "Guten Morgen, liebe Welt.", "fr-fr": "Bonjour tout le monde.",
    "ru": "Привет, мир.", "ar": "مرحبا بالعالم", "hi": "नमस्ते दुनिया", "cmn": "你好，世界。", "ko": "안녕하세요 여러분",
    "ja": "こんにちは、みなさん。", "th": "สวัสดีครับ", "sw": "Habari ya dunia.",
}  # fmt: skip


def seconds(content: bytes) -> float:
    with av.open(io.BytesIO(content)) as file:
        return float(sum(frame.samples / frame.sample_rate for frame in file.decode(audio=0)))


def ask(client: httpx.Client, path: str = "/v1/audio/speech", **body: Any) -> httpx.Response:
    answer = client.post(path, json={"model": "tts-1", "voice": "alloy", "input": TEXT} | body)
    assert answer.status_code == 200, answer.text
    return answer


@pytest.mark.parametrize(
    ("text", "language"),
    [("Привет, мир.", "ru"), ("你好，世界。", "cmn"), ("مرحبا بالعالم", "ar"), ("Guten Morgen, Welt.", "de")],
)
def test_the_language_is_guessed_and_can_be_given(client: httpx.Client, text: str, language: str) -> None:
    guessed = ask(client, input=text, response_format="pcm")
    assert guessed.headers[ADJUSTED] == f"the language is {language}; voice alloy is espeak-female"
    given = ask(client, input=text, language=language, response_format="pcm")
    assert given.headers[ADJUSTED] == "voice alloy is espeak-female"
    assert len(guessed.content) == len(given.content)


def test_the_openai_client_of_node(service: RunningService) -> None:
    packages = node_package("openai")
    shown = subprocess.run(
        ["node", "-e", NODE_CLIENT, service.url], env=os.environ | {"NODE_PATH": str(packages)},
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert shown.returncode == 0, shown.stderr
    found = json.loads(shown.stdout)
    assert found["bytes"] > 20_000
    assert found["adjusted"] == "voice af_bella is heart; speed 4 is 2"
    assert {"grid_s1", "tts-1", "kokoro"} <= set(found["models"])
    assert found["model"] == "tts-1-hd"
    assert "there is no voice 'nobody'" in found["refused"]


def test_the_openai_client_of_python(service: RunningService) -> None:
    openai = package("openai")
    client = openai.OpenAI(base_url=f"{service.url}/v1", api_key="unused", max_retries=0)
    assert client.models.retrieve("tts-1-1106").id == "tts-1-1106"
    with pytest.raises(openai.NotFoundError, match="there is no model 'nothing'"):
        client.models.retrieve("nothing")
    made = client.audio.speech.create(model="kokoro", voice="am_adam+af_sky", input=TEXT, response_format="wav")
    assert seconds(made.content) > 1.0


def test_open_webui_lists_and_speaks(client: httpx.Client) -> None:
    """It reads ids and names of voices, ids of models, and asks with the fields of its settings."""
    voices = {one["id"]: one["name"] for one in client.get("/v1/audio/voices").json()["voices"]}
    assert {"heart", "alloy", "af_bella"} <= set(voices)
    assert {"id": "tts-1", "name": "tts-1"} in client.get("/v1/audio/models").json()["models"]
    for voice in voices:
        assert len(ask(client, model="tts-1", voice=voice, input="Hi.").content) > 1000


def test_sillytavern_speaks(client: httpx.Client) -> None:
    body = {"input": "Hello.", "response_format": "mp3", "speed": 1, "voice": "nova", "model": "tts-1"}
    answer = client.post("/v1/audio/speech", json=body)
    assert answer.headers["content-type"] == "audio/mpeg"
    assert seconds(answer.content) > 0.3


def test_kokoros_clients_speak_and_ask(client: httpx.Client) -> None:
    assert seconds(client.post("/v1/audio/speech", json=KOKORO).content) > 1.0
    assert client.get("/health").json() == {"status": "healthy"}
    names = client.get("/v1/audio/voices", params={"legacy": "true"}).json()["voices"]
    assert "af_bella" in names
    phones = client.post("/dev/phonemize", json={"text": "Hello, world.", "language": "a"}).json()
    assert phones == {"phonemes": "həˈloʊ, ˈwɝld.", "tokens": []}
    loud, quiet = (
        client.post("/v1/audio/speech", json=KOKORO | {"response_format": "pcm", "volume_multiplier": volume}).content
        for volume in (1.0, 0.25)
    )
    ratio = np.abs(np.frombuffer(quiet, "<i2")).max() / np.abs(np.frombuffer(loud, "<i2")).max()
    assert ratio == pytest.approx(0.25, abs=0.02)


@pytest.mark.parametrize("is_streamed", [True, False])
def test_captioned_speech_has_the_times_of_words(client: httpx.Client, is_streamed: bool) -> None:
    answer = client.post("/dev/captioned_speech", json=KOKORO | {"stream": is_streamed})
    parts = [json.loads(line) for line in answer.text.splitlines()]
    assert (len(parts) > 1) == is_streamed
    assert {part["audio_format"] for part in parts} == {"audio/mpeg"}
    length = seconds(b"".join(base64.b64decode(part["audio"]) for part in parts))
    words = [word for part in parts for word in part["timestamps"]]
    assert [word["word"] for word in words] == ["Hello", "there", "This", "is", "a", "test"]
    assert all(0 <= word["start_time"] < word["end_time"] < length for word in words)
    none = client.post("/dev/captioned_speech", json=KOKORO | {"return_timestamps": False, "stream": False}).json()
    assert none["timestamps"] == []


@pytest.mark.parametrize("language", TIMED)
def test_words_and_phones_have_times_in_all_languages(client: httpx.Client, language: str) -> None:
    body = {"input": TIMED[language], "language": language, "timestamps": ["word", "phone"]}
    found = ask(client, **body, response_format="wav").json()
    length = seconds(base64.b64decode(found["audio"]))
    assert found["audio_format"] == "audio/wav"
    written = "".join(letter for letter in TIMED[language] if letter.isalpha())
    assert "".join(letter for word in found["words"] for letter in word["word"] if letter.isalpha()) == written
    phones = found["phones"]
    assert phones[0]["start"] == 0
    assert phones[-1]["end"] == pytest.approx(length, abs=0.01)
    assert all(one["end"] == pytest.approx(other["start"], abs=2e-4) for one, other in pairwise(phones))
    edges = {round(1000 * phone[end]) for phone in phones for end in ("start", "end")}
    assert {round(1000 * word[end]) for word in found["words"] for end in ("start", "end")} <= edges


def test_events_have_times_before_the_sound_of_a_sentence(client: httpx.Client) -> None:
    lines = ask(client, stream_format="sse", timestamps=["word"], response_format="pcm").text.splitlines()
    events = [json.loads(line.removeprefix("data: ")) for line in lines if line]
    kinds = [event["type"] for event in events]
    assert kinds == ["speech.timestamps", "speech.audio.delta"] * 2 + ["speech.audio.done"]
    assert [word["word"] for word in events[2]["words"]] == ["This", "is", "a", "test"]
    first = len(base64.b64decode(events[1]["audio"])) / 48_000
    assert events[0]["words"][-1]["end"] <= first <= events[2]["words"][0]["start"]
    assert set(events[0]) == {"type", "words"}
