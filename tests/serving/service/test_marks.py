"""Marks of synthesis in answers, jobs and live streams, and those that an operator sets for all clients."""

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from starlette.testclient import TestClient

import tts2face
from lexicon.errors import InputError
from tests.packages import package
from tests.serving.service.in_process import SessionProcess, TableProcess, service_client, working
from tests.serving.service.job_requests import finished, submit
from tts2face.serving.service.settings import ServiceSettings
from tts2face.session.inspection import inspect_file
from tts2face.session.session_cache import SessionCache

SPEECH = {"input": "Hello there.", "voice": "alloy", "model": "tts-1"}
CLIP = {"text": "Hello there.", "voice": "espeak", "size": "64x64", "fps": 10}


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    settings = ServiceSettings(
        data=tmp_path_factory.mktemp("data"), workers=0, spoken_mark="auto", visible_mark=True, studio=False
    )
    with service_client(settings, SessionProcess(SessionCache(1))) as client:
        yield client


@pytest.mark.parametrize("format", ["wav", "mp3", "opus", "flac", "aac", "pcm"])
def test_speech_says_that_it_is_synthetic(format: str, client: TestClient, tmp_path: Path) -> None:
    answer = client.post("/v1/audio/speech", json={**SPEECH, "response_format": format})
    assert answer.headers["x-synthetic"] == f"tts2face {tts2face.__version__}"
    if format != "pcm":
        (tmp_path / f"a.{format}").write_bytes(answer.content)
        found = inspect_file(tmp_path / f"a.{format}")
        assert found.is_synthetic
        assert found.text == "This voice is synthetic.  Hello there."


def test_clients_may_choose_other_words_and_not_none(client: TestClient, tmp_path: Path) -> None:
    answer = client.post("/v1/clips", json={**CLIP, "format": "wav", "spoken_mark": "I am a machine."})
    (tmp_path / "a.wav").write_bytes(answer.content)
    assert inspect_file(tmp_path / "a.wav").text == "I am a machine.  Hello there."
    assert client.post("/v1/clips", json={**CLIP, "format": "wav", "spoken_mark": None}).status_code in {200, 422}


def test_pictures_have_the_label_of_the_operator(client: TestClient) -> None:
    processes = client.app.state.service.pool.processes  # type: ignore[attr-defined]
    before, table = list(processes), TableProcess({"mp4": b"film"})
    processes[:] = [table]
    try:
        for wanted in ({}, {"visible_mark": False}):
            assert client.post("/v1/clips", json={**CLIP, **wanted, "format": "mp4"}).status_code == 200
    finally:
        processes[:] = before
    assert [work.picture["visible_mark"] for work in table.works] == [True, True]
    assert [work.request["spoken_mark"] for work in table.works] == ["auto", "auto"]


def test_the_first_event_of_a_live_stream_is_its_mark(client: TestClient) -> None:
    with client.websocket_connect("ws://localhost/v1/stream") as socket:
        socket.send_json({"type": "start", "with_idle": False, "voice": "espeak"})
        socket.send_json({"type": "text", "text": "Hello there."})
        socket.send_json({"type": "end"})
        events = []
        while not events or events[-1]["type"] != "done":
            message = socket.receive()
            if message.get("text"):
                events.append(json.loads(message["text"]))
    assert events[0]["type"] == "mark"
    assert events[0]["digitalSourceType"].endswith("/trainedAlgorithmicMedia")
    assert [one["text"] for one in events if one["type"] == "speech"] == ["This voice is synthetic.", "Hello there."]


def test_results_of_jobs_are_signed(tmp_path: Path) -> None:
    package("c2pa")
    credentials = package("tests.storage.authority").issue(tmp_path)
    settings = ServiceSettings(
        data=tmp_path / "data", workers=0, studio=False, sign_certificate=credentials.certificate,
        sign_key=credentials.key,
    )  # fmt: skip
    signer = credentials.open()
    with service_client(settings, SessionProcess(SessionCache(1, signer=signer))) as client:
        with working(settings, signer):
            jobs = [
                finished(client, submit(client, {**CLIP, "format": name}).json()) for name in ("mp4", "wav", "curves")
            ]
        for job in jobs:
            (result,) = job["results"]
            (tmp_path / result["name"]).write_bytes(client.get(result["url"]).content)
        complete = client.post("/v1/audio/speech", json={**SPEECH, "response_format": "flac"})
        (tmp_path / "a.flac").write_bytes(complete.content)
    for name in ("clip.mp4", "clip.wav", "a.flac"):
        signature = inspect_file(tmp_path / name).signature
        assert signature is not None
        assert (signature.state, signature.signer) == ("Valid", "Ann")


def test_settings_of_signatures_belong_together(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="sign_certificate and sign_key belong together; give both or neither"):
        ServiceSettings(sign_key=tmp_path / "key.pem")
    both = ServiceSettings(sign_certificate=tmp_path / "a", sign_key=tmp_path / "b", sign_password="open sesame")
    assert both.signing is not None
    assert "sesame" not in repr(both) + both.as_toml()
    assert replace(both, sign_certificate=None, sign_key=None).signing is None
