"""Live streams against a running service."""

import asyncio
import json
import time
from typing import Any

import numpy as np
import pytest
import websockets

from tests.service.conftest import RunningService

WORDS = ["Hello", "there,", "how", "are", "you?", "I", "am", "well.", "And"]


class Live:
    """A live stream and everything it has sent, with the seconds at which it came."""

    def __init__(self, connection: Any) -> None:
        self.connection = connection
        self.came: list[tuple[float, Any]] = []

    async def send(self, **content: Any) -> None:
        await self.connection.send(json.dumps(content))

    async def receive_until(self, kind: str, *, timeout_s: float = 30.0) -> dict[str, Any]:
        async with asyncio.timeout(timeout_s):
            while True:
                message = await self.connection.recv()
                content = message if isinstance(message, bytes) else json.loads(message)
                self.came.append((time.monotonic(), content))
                if isinstance(content, dict) and content["type"] == kind:
                    return content

    def events(self, kind: str) -> list[dict[str, Any]]:
        return [one for _, one in self.came if isinstance(one, dict) and one["type"] == kind]

    @property
    def sound(self) -> bytes:
        return b"".join(one for _, one in self.came if isinstance(one, bytes))


def converse(service: RunningService, talk: Any, **options: Any) -> Live:
    async def run() -> Live:
        address = service.url.replace("http", "ws", 1) + "/v1/stream"
        async with websockets.connect(address, max_size=None) as connection:
            live = Live(connection)
            await live.send(type="start", **options)
            await talk(live)
            return live

    return asyncio.run(run())


def test_sentences_are_spoken_as_soon_as_they_are_complete(service: RunningService) -> None:
    async def talk(live: Live) -> None:
        for word in WORDS[:6]:
            await live.send(type="text", text=f"{word} ")
        first = await live.receive_until("speech")
        assert first["text"] == "Hello there, how are you?"
        for word in WORDS[6:]:
            await live.send(type="text", text=f"{word} ")
        await live.send(type="end")
        await live.receive_until("done")

    live = converse(service, talk, with_idle=False)
    spoken = live.events("speech")
    assert [one["text"] for one in spoken] == ["Hello there, how are you?", "I am well.", "And"]
    assert spoken[1]["begin"] == pytest.approx(spoken[0]["begin"] + spoken[0]["seconds"], abs=0.01)
    assert [word for word, *_ in spoken[0]["words"]] == ["Hello", "there", "how", "are", "you"]
    assert spoken[0]["phones"][0][0] == "sil"
    assert all(one["begin"] <= begin < end for one in spoken for _, begin, end in one["words"])
    assert len(live.sound) == 2 * round(sum(one["seconds"] for one in spoken) * 24_000)
    curves = live.events("curves")
    assert len(curves) == 3
    weights = np.concatenate([one["weights"] for one in curves])
    assert weights.shape[1] == len(curves[0]["names"]) == 52
    assert weights[:, curves[0]["names"].index("jawOpen")].max() > 0.1
    assert len(weights) == round(sum(one["seconds"] for one in spoken) * 30)


def test_a_living_face_fills_the_silence_in_real_time(service: RunningService) -> None:
    async def talk(live: Live) -> None:
        begin = time.monotonic()
        while time.monotonic() < begin + 2.0:
            await live.receive_until("curves")
        await live.send(type="text", text="Hello there. ")
        await live.send(type="flush")
        await live.receive_until("speech")
        await live.receive_until("curves")

    live = converse(service, talk)
    curves = live.events("curves")
    began = live.came[0][0]
    ends = [one["begin"] + len(one["weights"]) / one["fps"] for one in curves]
    assert [one["begin"] for one in curves[1:]] == pytest.approx(ends[:-1], abs=1e-3)  # without a gap
    idle = [(at - began, one) for at, one in live.came if isinstance(one, dict) and one["type"] == "curves"][:-1]
    for at, one in idle[3:]:
        assert -0.3 < one["begin"] - at < 0.7  # near the clock, neither late nor far ahead
    assert np.ptp(np.concatenate([one["head"] for _, one in idle]), axis=0)[:3].max() > 0.001  # radians


def test_cancel_forgets_the_text_that_waits(service: RunningService) -> None:
    async def talk(live: Live) -> None:
        await live.send(type="text", text="One sentence. " * 30)
        await live.receive_until("speech")
        await live.send(type="cancel")
        cancelled = time.monotonic()
        await live.receive_until("cancelled")
        assert time.monotonic() - cancelled < 2.0
        await live.send(type="text", text="A new one.")
        await live.send(type="end")
        await live.receive_until("done")

    live = converse(service, talk, with_idle=False)
    spoken = [one["text"] for one in live.events("speech")]
    assert spoken[-1] == "A new one."
    assert len(spoken) < 20


def test_a_sentence_that_cannot_be_spoken_does_not_end_the_stream(service: RunningService) -> None:
    async def talk(live: Live) -> None:
        await live.send(type="text", text="漢字. Hello there. ")
        await live.send(type="fly")
        await live.send(type="end")
        await live.receive_until("done")

    live = converse(service, talk, with_idle=False)
    assert [one["text"] for one in live.events("speech")] == ["Hello there."]
    messages = " ".join(one["message"] for one in live.events("error"))
    assert "cannot read 漢字" in messages
    assert "one of the types cancel, end, flush, text" in messages


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"fps": 1000}, "fps: Input should be less than"),
        ({"voice": "/tmp/x.onnx"}, "there is no voice"),
        ({"song": "la"}, "song: Extra inputs"),
    ],
)
def test_wrong_options_are_refused(service: RunningService, options: dict[str, Any], reason: str) -> None:
    async def talk(live: Live) -> None:
        assert reason in (await live.receive_until("error"))["message"]

    converse(service, talk, **options)
