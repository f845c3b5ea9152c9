"""Live streams against a running service."""

import asyncio
import json
import time
from typing import Any

import httpx
import numpy as np
import pytest
import websockets

import tts2face
from tests.running import RunningService, eventually
from tts2face.interchange.exports.arkit import arkit_projection
from tts2face.serving.service.live import AHEAD_S

WORDS = ["Hello", "there,", "how", "are", "you?", "I", "am", "well.", "And"]
LONG = "The garden behind the old house near the river had been green for years. "


class Live:
    """A live stream and everything it has sent, with the seconds at which it came."""

    def __init__(self, connection: Any) -> None:
        self.connection, self.began = connection, time.monotonic()
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


def test_a_living_face_fills_the_silence_in_real_time(service: RunningService) -> None:
    async def talk(live: Live) -> None:
        while (await live.receive_until("curves"))["begin"] < 1.5:  # it follows the clock, however busy the machine
            pass
        await live.send(type="text", text="Hello there. ")
        await live.send(type="flush")
        await live.receive_until("speech")
        await live.receive_until("curves")

    live = converse(service, talk)
    curves = live.events("curves")
    ends = [one["begin"] + len(one["weights"]) / one["fps"] for one in curves]
    assert [one["begin"] for one in curves[1:]] == pytest.approx(ends[:-1], abs=1e-3)  # without a gap
    idle = [(at - live.began, one) for at, one in live.came if isinstance(one, dict) and one["type"] == "curves"][:-1]
    assert all(one["begin"] < at + AHEAD_S + 1e-3 for at, one in idle)  # never far ahead of the clock
    assert np.ptp(np.concatenate([one["head"] for _, one in idle]), axis=0)[:3].max() > 0.001  # radians


def test_a_face_listens_to_the_partner_and_then_answers(service: RunningService) -> None:
    async def talk(live: Live) -> None:
        await live.send(type="listen", rate=16_000)
        await live.connection.send(bytes(6_400))
        while (await live.receive_until("curves"))["begin"] < 0.4:
            pass
        await live.send(type="text", text="Yes.")
        await live.send(type="end")
        await live.receive_until("done")

    live = converse(service, talk, with_idle=False)
    (said,) = live.events("speech")
    assert said["phones"][0][2] - said["begin"] == pytest.approx(0.3, abs=0.1)  # in which it takes breath
    assert not live.events("error")


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


@pytest.mark.parametrize("name", ["cancel", "interrupt"])
def test_cancel_interrupts_a_sentence(service: RunningService, name: str) -> None:
    """The sentence that is being made is not sent, and the next one is spoken."""

    async def talk(live: Live) -> None:
        await live.send(type="text", text=LONG)
        await live.send(type="flush")
        await asyncio.sleep(0.1)
        await live.send(type=name)
        await live.receive_until("cancelled")
        await live.send(type="text", text="A new one.")
        await live.send(type="end")
        await live.receive_until("done")

    live = converse(service, talk, with_idle=False)
    assert [one["text"] for one in live.events("speech")][-1] == "A new one."
    assert live.events("error") == []
    (cancelled,) = live.events("cancelled")
    assert cancelled["after_ms"] >= 0
    assert live.events("speech")[-1]["begin"] == pytest.approx(cancelled["at"], abs=1e-3)


def test_a_client_that_leaves_frees_its_work(service: RunningService, client: httpx.Client) -> None:
    def measure(name: str) -> float:
        lines = client.get("/metrics").text.splitlines()
        return next(float(line.split()[-1]) for line in lines if line.startswith(name))

    before = measure("tts2face_cancel_seconds_count")

    async def talk(live: Live) -> None:
        await live.send(type="text", text=LONG * 5)
        await live.receive_until("speech")

    converse(service, talk, with_idle=False)
    eventually(lambda: measure("tts2face_cancel_seconds_count") != before and measure("tts2face_load") == 0, 30.0)


def speech_samples(rate: int) -> np.ndarray:
    """16-bit samples of a spoken sentence."""
    import soxr

    sound = tts2face.Session().clip("Bob may move five big maps.", gestures="none").speech.waveform
    return np.clip(soxr.resample(sound.samples, sound.rate, rate) * 32767, -32768, 32767).astype("<i2")


@pytest.mark.parametrize(("rate", "tolerance"), [(16_000, 0.0), (24_000, 0.02)])
def test_curves_of_a_microphone_are_those_of_python(service: RunningService, rate: int, tolerance: float) -> None:
    """Equal at 16 kHz; within a fiftieth of a weight at other rates, as resampling depends on the blocks a little."""
    samples = speech_samples(rate)

    async def talk(live: Live) -> None:
        for begin in range(0, len(samples), rate // 10):
            await live.connection.send(samples[begin : begin + rate // 10].tobytes())
        await live.send(type="end")
        await live.receive_until("done")

    live = converse(service, talk, input="audio", rate=rate)
    received = np.concatenate([one["weights"] for one in live.events("curves")])
    session = tts2face.Session()
    lips = session.listen(rate)
    parts = [lips.add_samples(samples.astype(np.float32) / 32768), lips.finish()]
    motion = np.concatenate([part.values for part in parts if part is not None])
    channels = next(part.channels for part in parts if part is not None)
    expected = arkit_projection(channels, session.mesh, "the test").weights(motion)
    assert np.abs(received - expected).max() <= tolerance + 5e-5  # sent with four decimals
    assert len(received) == pytest.approx(len(samples) / rate * lips.fps, abs=1.01)
    assert np.ptp(received[:, live.events("curves")[0]["names"].index("jawOpen")]) > 0.1
    (listening,) = live.events("listening")
    assert listening["look_ahead_s"] == pytest.approx(lips.look_ahead_s, abs=1e-4)
    begins = [one["begin"] for one in live.events("curves")]
    ends = [one["begin"] + len(one["weights"]) / one["fps"] for one in live.events("curves")]
    assert begins == pytest.approx([0.0, *ends[:-1]], abs=1e-3)
