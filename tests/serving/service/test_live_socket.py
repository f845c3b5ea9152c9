"""Live streams of a client in this process: their sentences, and what is refused while they go on."""

import json
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from starlette.testclient import TestClient, WebSocketTestSession

from tests.serving.service.in_process import SessionProcess, service_client
from tts2face.serving.service.settings import ServiceSettings
from tts2face.session.session_cache import SessionCache

WORDS = ["Hello", "there,", "how", "are", "you?", "I", "am", "well.", "And"]


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    settings = ServiceSettings(data=tmp_path_factory.mktemp("data"), workers=0)
    with service_client(settings, SessionProcess(SessionCache(1))) as client:
        yield client


class Live:
    """A live stream and everything that it has sent."""

    def __init__(self, socket: WebSocketTestSession) -> None:
        self.socket = socket
        self.events: list[dict[str, Any]] = []
        self.sound = b""

    def send(self, **content: Any) -> None:
        self.socket.send_text(json.dumps(content))

    def receive_until(self, kind: str) -> dict[str, Any]:
        while True:
            message = self.socket.receive()
            assert message["type"] == "websocket.send", message
            if message.get("bytes"):
                self.sound += message["bytes"]
                continue
            self.events.append(json.loads(message["text"]))
            if self.events[-1]["type"] == kind:
                return self.events[-1]

    def of(self, kind: str) -> list[dict[str, Any]]:
        return [one for one in self.events if one["type"] == kind]


@pytest.fixture
def live(client: TestClient) -> Iterator[Live]:
    with client.websocket_connect("ws://localhost/v1/stream") as socket:
        yield Live(socket)


def test_sentences_are_spoken_as_soon_as_they_are_complete(live: Live) -> None:
    live.send(type="start", with_idle=False)
    for word in WORDS[:6]:
        live.send(type="text", text=f"{word} ")
    first = live.receive_until("speech")
    assert first["text"] == "Hello there, how are you?"
    for word in WORDS[6:]:
        live.send(type="text", text=f"{word} ")
    live.send(type="end")
    live.receive_until("done")
    spoken = live.of("speech")
    assert [one["text"] for one in spoken] == ["Hello there, how are you?", "I am well.", "And"]
    assert spoken[1]["begin"] == pytest.approx(spoken[0]["begin"] + spoken[0]["seconds"], abs=0.01)
    assert [word for word, *_ in spoken[0]["words"]] == ["Hello", "there", "how", "are", "you"]
    assert spoken[0]["phones"][0][0] == "sil"
    assert all(one["begin"] <= begin < end for one in spoken for _, begin, end in one["words"])
    assert len(live.sound) == 2 * round(sum(one["seconds"] for one in spoken) * 24_000)
    curves = live.of("curves")
    assert len(curves) == 3
    weights = np.concatenate([one["weights"] for one in curves])
    assert weights.shape[1] == len(curves[0]["names"]) == 52
    assert weights[:, curves[0]["names"].index("jawOpen")].max() > 0.1
    assert len(weights) == round(sum(one["seconds"] for one in spoken) * 30)


@pytest.mark.parametrize("wrong", [7, {"a": 1}, ["Hello."], True], ids=str)
def test_null_is_no_text_and_other_types_are_refused(live: Live, wrong: Any) -> None:
    live.send(type="start", with_idle=False, voice="espeak")
    for text in ("Hello there. ", None, wrong, "Good bye."):
        live.send(type="text", text=text)
    live.send(type="text")
    live.send(type="end")
    live.receive_until("done")
    assert [one["text"] for one in live.of("speech")] == ["Hello there.", "Good bye."]
    assert [one["message"] for one in live.of("error")] == [
        f"text must be a text, or null for none, not {json.dumps(wrong)}; send words"
    ]


@pytest.mark.parametrize(
    ("block", "reason"),
    [
        (b"123", "a block of sound has 3 bytes; send 16-bit samples"),
        (bytes(70_000), "a block of sound has 70000 bytes"),
        ('{"type": "text", "text": "Hello."}', "16-bit samples, or JSON with one of the types end"),
    ],
)
def test_wrong_sound_is_refused_and_the_stream_goes_on(live: Live, block: bytes | str, reason: str) -> None:
    live.send(type="start", input="audio")
    live.socket.send_text(block) if isinstance(block, str) else live.socket.send_bytes(block)
    live.socket.send_bytes(bytes(32_000))
    live.send(type="end")
    live.receive_until("done")
    assert [reason in one["message"] for one in live.of("error")] == [True]
    assert sum(len(one["weights"]) for one in live.of("curves")) == 25


def test_a_stream_of_text_refuses_sound_to_which_it_does_not_listen(live: Live) -> None:
    live.send(type="start", with_idle=False)
    live.socket.send_bytes(b"1234")
    refused = live.receive_until("error")
    assert "sound of the other is heard after listen with its sample rate" in refused["message"]


def test_a_sentence_that_cannot_be_spoken_does_not_end_the_stream(live: Live) -> None:
    live.send(type="start", with_idle=False)
    live.send(type="text", text="<speak>Bye <break>.</speak>")
    live.send(type="flush")
    live.send(type="text", text="Hello there. ")
    live.send(type="fly")
    live.send(type="end")
    live.receive_until("done")
    assert [one["text"] for one in live.of("speech")] == ["Hello there."]
    messages = " ".join(one["message"] for one in live.of("error"))
    assert "mismatched tag in line 1; close <break>" in messages
    assert "one of the types cancel, end, flush, gesture, interrupt, listen, style, text" in messages


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"fps": 1000}, "fps: Input should be less than"),
        ({"voice": "/tmp/x.onnx"}, "there is no voice"),
        ({"song": "la"}, "song: Extra inputs"),
        ({"input": "audio", "rate": 1.0}, "rate: Input should be a valid integer"),
        ({"input": "audio", "voice": "heart"}, "voice: Extra inputs"),
        ({"input": "pictures"}, "input: Input should be 'text'"),
    ],
)
def test_wrong_options_are_refused(live: Live, options: dict[str, Any], reason: str) -> None:
    live.send(type="start", **options)
    assert reason in live.receive_until("error")["message"]
