"""Keys against each other at a real server: messages of sockets count, and nobody takes all places to wait."""

import asyncio
import json
from collections.abc import Iterator
from contextlib import AsyncExitStack, ExitStack, closing, suppress
from pathlib import Path
from typing import Any

import httpx
import pytest
import websockets

from tests.running import HostService, RunningService, eventually
from tests.serving.service.raw import connect, request
from tts2face.serving.service.keys import add_key
from tts2face.serving.service.pool import LINES_COST, LIVE_COST, PLACES

N_PLACES = 64  # as by default: the services of a run of the tests share one pool
N_ASKED = 80  # movies
LONG = "We were away a year ago, but Bob may move five big maps. " * 100
PERSON = {"text": "Yes.", "size": "64x64", "format": "mp4"}
Keys = dict[str, str]


@pytest.fixture(scope="module")
def keys(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Keys]:
    path = tmp_path_factory.mktemp("keys") / "keys.toml"
    names: dict[str, dict[str, Any]] = {
        "greedy": {}, "modest": {}, "five": {"requests_per_minute": 5, "concurrent": 1},
        "six": {"requests_per_minute": 6},
    }  # fmt: skip
    return path, {name: add_key(path, name, ["speak", "admin"], **limits) for name, limits in names.items()}


@pytest.fixture(scope="module")
def running(host: HostService, keys: tuple[Path, Keys]) -> Iterator[RunningService]:
    with host(keys=keys[0], workers=0, live_characters_per_minute=3000) as running:
        yield running


def socket(service: RunningService, path: str, key: str) -> Any:
    address = service.url.replace("http", "ws", 1) + path
    return websockets.connect(address, max_size=None, additional_headers={"authorization": f"Bearer {key}"})


def measure(service: RunningService, name: str, key: str) -> float:
    headers = {"authorization": f"Bearer {key}"}
    lines = httpx.get(f"{service.url}/metrics", headers=headers, timeout=60).text.splitlines()
    return next(float(line.split()[-1]) for line in lines if line.startswith(f"{name} "))


def test_every_synthesize_of_a_socket_is_a_request(running: RunningService, keys: tuple[Path, Keys]) -> None:
    async def ask() -> list[Any]:
        found: list[Any] = []
        async with socket(running, "/", keys[1]["five"]) as connection:
            for number in range(20):
                await connection.send(json.dumps({"type": "synthesize", "id": number, "data": {"input": "Yes."}}))
            while len(found) < 20:
                content = await connection.recv()
                if isinstance(content, str):
                    found.append(json.loads(content))
        return found

    answers = asyncio.run(ask())
    assert [one["ref"] for one in answers] == list(range(20))  # one after another
    types = [one["type"] for one in answers]
    assert types[:5] == ["audio"] * 4 + ["error"]  # the socket itself is the first request
    assert types.count("audio") <= 5  # one comes back every twelve seconds
    refused = [one["data"]["error"] for one in answers if one["type"] == "error"]
    assert all("the key five has used its 5 requests a minute; wait" in one for one in refused)


def test_every_sentence_of_a_live_stream_is_a_request(running: RunningService, keys: tuple[Path, Keys]) -> None:
    async def talk() -> list[Any]:
        found: list[Any] = []
        async with socket(running, "/v1/stream", keys[1]["six"]) as connection:
            await connection.send(json.dumps({"type": "start", "with_idle": False}))
            await connection.send(json.dumps({"type": "text", "text": "Yes. " * 50}))
            await connection.send(json.dumps({"type": "end"}))
            while not found or found[-1]["type"] != "done":
                content = await connection.recv()
                if isinstance(content, str):
                    found.append(json.loads(content))
        return found

    events = asyncio.run(talk())
    spoken = [one["text"] for one in events if one["type"] == "speech"]
    assert 5 <= len(spoken) <= 6  # a request comes back every ten seconds
    refused = [one["message"] for one in events if one["type"] == "error"]
    assert "'Yes.' and what follows it in the message is not spoken: the key six has used its 6 requests" in refused[0]


def test_a_key_cannot_take_all_places(running: RunningService, keys: tuple[Path, Keys]) -> None:
    """While its movies have all places to run and to wait, another key has movies and speech at once."""
    greedy, modest = keys[1]["greedy"], keys[1]["modest"]
    body = json.dumps({"text": LONG}).encode()
    asked = request("POST", "/v1/clips", body, f"Authorization: Bearer {greedy}")
    headers = {"authorization": f"Bearer {modest}"}

    async def ask() -> list[int]:
        async with httpx.AsyncClient(timeout=120, headers=headers) as client, asyncio.timeout(120):
            sent = [client.post(f"{running.url}/v1/clips", json=PERSON) for _ in range(2)]
            answers = await asyncio.gather(*sent, client.post(f"{running.url}/v1/synthesize", json={"input": "Yes."}))
        return [answer.status_code for answer in answers]

    with ExitStack() as connections:
        for _ in range(N_ASKED):
            connections.enter_context(closing(connect(running.url))).sendall(asked)
        eventually(lambda: measure(running, "tts2face_waiting", modest) == N_PLACES)
        assert asyncio.run(ask()) == [200, 200, 200]
        assert measure(running, "tts2face_waiting", modest) > 0  # of the other key


def test_silent_streams_hold_no_places(running: RunningService, keys: tuple[Path, Keys]) -> None:
    """More than a process has places for lines: another one of them, and curves of another key, begin at once."""
    greedy, modest = keys[1]["greedy"], keys[1]["modest"]
    n_silent = 2 * PLACES[LINES_COST] + 1

    async def ask() -> tuple[str, int]:
        async with AsyncExitStack() as stack:
            for _ in range(n_silent):
                silent = await stack.enter_async_context(socket(running, "/v1/stream", greedy))
                await silent.send(json.dumps({"type": "start", "with_idle": False}))
            await asyncio.to_thread(
                eventually, lambda: measure(running, "tts2face_load", modest) == pytest.approx(n_silent * LIVE_COST)
            )
            await silent.send(json.dumps({"type": "text", "text": "Yes."}))
            await silent.send(json.dumps({"type": "flush"}))
            assert json.loads(await asyncio.wait_for(silent.recv(), 60))["type"] == "mark"
            spoken = json.loads(await asyncio.wait_for(silent.recv(), 60))
            async with httpx.AsyncClient(timeout=60, headers={"authorization": f"Bearer {modest}"}) as client:
                curves = await client.post(f"{running.url}/v1/clips", json={"text": "Yes.", "format": "curves"})
        return spoken["type"], curves.status_code

    assert asyncio.run(ask()) == ("speech", 200)


def test_large_texts_of_live_streams_are_refused(running: RunningService, keys: tuple[Path, Keys]) -> None:
    """Two streams with texts of 1 MB: none is spoken, and another key is served meanwhile."""
    greedy, modest = keys[1]["greedy"], keys[1]["modest"]
    made = measure(running, "tts2face_speech_seconds_total", modest)
    text = json.dumps({"type": "text", "text": (LONG * 200)[:1_000_000]})

    async def flood() -> list[str]:
        found: list[str] = []
        async with socket(running, "/v1/stream", greedy) as connection:
            await connection.send(json.dumps({"type": "start", "with_idle": False}))
            assert json.loads(await connection.recv())["type"] == "mark"
            sending = asyncio.create_task(_send_many(connection, text))
            while len(found) < 5:
                found.append(json.loads(await connection.recv())["message"])
            sending.cancel()
        return found

    async def attack() -> list[list[str]]:
        floods = [asyncio.create_task(flood()) for _ in range(2)]
        async with httpx.AsyncClient(timeout=60, headers={"authorization": f"Bearer {modest}"}) as client:
            answer = await client.post(f"{running.url}/v1/synthesize", json={"input": "Yes."})
        assert answer.status_code == 200
        return await asyncio.gather(*floods)

    for messages in asyncio.run(attack()):
        assert all("a message has 10000" in one and "send at most 32768, in parts" in one for one in messages)
    assert measure(running, "tts2face_speech_seconds_total", modest) - made < 3.0  # that of the other key


async def _send_many(connection: Any, text: str) -> None:
    with suppress(websockets.ConnectionClosed):
        for _ in range(30):
            await connection.send(text)
