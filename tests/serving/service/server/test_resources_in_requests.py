"""Uploads are used by every kind of request, as long as they exist; a running service."""

import asyncio
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest
from websockets.asyncio.client import connect

import tts2face
from tests.models.made import write_made_models
from tests.running import RunningService
from tts2face.storage.shipped import find_file

TEXT = "We were away."
MAMA = b"away  M AA1 M AA0\n"  # another word than the one that is written


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    return write_made_models(tmp_path_factory.mktemp("uploads"), MAMA)


@pytest.fixture(scope="module")
def uploaded(service: RunningService, files: dict[str, Path]) -> Iterator[dict[str, Path]]:
    """All files, uploaded under the name "mine"."""
    for kind, path in files.items():
        upload(service.url, kind, "mine", path)
    yield files
    for kind in files:
        httpx.delete(address(service.url, kind, "mine"))


def address(url: str, kind: str, name: str = "") -> str:
    many = "dictionaries" if kind == "dictionary" else f"{kind}s"
    return f"{url}/v1/{many}{'/' + name if name else ''}"


def upload(url: str, kind: str, name: str, path: Path) -> None:
    with path.open("rb") as file:
        answer = httpx.post(address(url, kind), data={"name": name}, files={"file": ("x", file)}, timeout=300)
    assert answer.status_code == 201, answer.text


def curves(client: httpx.Client, **options: Any) -> list[Any]:
    answer = client.post("/v1/clips", json={"text": TEXT, "format": "curves", **options})
    assert answer.status_code == 200, answer.text
    return [json.loads(line) for line in answer.text.splitlines()]


def test_a_clip_is_that_of_the_file(client: httpx.Client, uploaded: dict[str, Path]) -> None:
    """With a talker, palette and dictionary of the key: the bytes that a session gives with their files."""
    names = {"talker": "mine", "palette": "mine", "dictionary": "mine"}
    answer = client.post("/v1/clips", json={"text": TEXT, "format": "curves", **names})
    assert answer.status_code == 200, answer.text
    session = tts2face.Session(uploaded["talker"], palette=uploaded["palette"])
    request = tts2face.Request(text=TEXT, dictionary=uploaded["dictionary"])
    assert answer.content == b"".join(chunk.content for chunk in session.stream_file(request, "curves"))


def test_a_face_is_drawn(client: httpx.Client, uploaded: dict[str, Path]) -> None:
    options = {"text": TEXT, "size": "64x64", "supersampling": 1, "gestures": "none", "format": "webm"}
    own = client.post("/v1/clips", json={**options, "face": "mine"})
    head = client.post("/v1/clips", json=options)
    assert (own.status_code, head.status_code) == (200, 200), own.text
    assert own.content != head.content
    wrong = client.post("/v1/clips", json={**options, "face": "mine", "identity": "amara"})
    assert (wrong.status_code, wrong.json()["error"]["message"]) == (
        400, "the face mine has no identity 'amara'; it has: older"
    )  # fmt: skip


def test_every_kind_of_speech_reads_the_dictionary(client: httpx.Client, uploaded: dict[str, Path]) -> None:
    plain = client.post("/v1/synthesize", json={"input": TEXT}).json()
    own = client.post("/v1/synthesize", json={"input": TEXT, "dictionary": "mine"}).json()
    assert plain["phonemes"] != own["phonemes"]
    assert own["phonemes"].count("m") == 2
    body = {"model": "mine", "input": TEXT, "voice": "alloy", "response_format": "oculus"}
    spoken = [client.post("/v1/audio/speech", json=body | more).text for more in ({}, {"dictionary": "mine"})]
    assert spoken[0] != spoken[1]


def test_a_live_stream_reads_the_dictionary(service: RunningService, uploaded: dict[str, Path]) -> None:
    async def run() -> list[str]:
        async with connect(service.url.replace("http", "ws") + "/v1/stream") as socket:
            await socket.send(json.dumps({"type": "start", "with_idle": False, "talker": "mine", "dictionary": "mine"}))
            for message in ({"type": "text", "text": TEXT}, {"type": "end"}):
                await socket.send(json.dumps(message))
            events = [json.loads(message) async for message in socket if isinstance(message, str)]
        assert events[-1] == {"type": "done"}, events[-1]
        return [phone for event in events if event["type"] == "speech" for phone, *_ in event["phones"]]

    assert asyncio.run(run()).count("m") == 2


def test_models_and_voices_list_them(client: httpx.Client, uploaded: dict[str, Path]) -> None:
    assert "mine" in [one["id"] for one in client.get("/v1/models").json()["data"]]


def test_a_deleted_name_is_gone_and_a_new_content_is_used(service: RunningService, client: httpx.Client) -> None:
    """A session that is still in memory never answers for another content of its name."""
    names = {"face": "other", "gestures": "none"}
    upload(service.url, "face", "other", find_file("ada", "face"))
    first = curves(client, **names)
    assert client.delete("/v1/faces/other").status_code == 204
    gone = client.post("/v1/clips", json={"text": TEXT, "format": "curves", **names})
    assert (gone.status_code, "there is no face 'other'" in gone.text) == (400, True)
    upload(service.url, "face", "other", find_file("head", "face"))
    second = curves(client, **names)
    assert second != first
    assert second == curves(client, face="head", gestures="none")
    client.delete("/v1/faces/other")
