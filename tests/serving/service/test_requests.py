"""What requests ask the pool for, and why they are refused: forms, names, limits, ranges and routes, in one process."""

import io
import json
import tempfile
import wave
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from starlette.testclient import TestClient

import tts2face
from tests.packages import package
from tests.serving.service.in_process import (
    SessionProcess,
    TableProcess,
    decoding_here,
    service_client,
    working,
)
from tests.serving.service.job_requests import CLIP, finished, submit
from tests.serving.service.test_uploads import png, png_bomb, wav
from tests.walkers import samples_of
from tts2face.serving.service.messages import Work
from tts2face.serving.service.settings import ServiceSettings
from tts2face.session.session_cache import SessionCache

TEXT = "Hello there. This is a test."
SPEECH = {"input": TEXT, "voice": "alloy", "model": "tts-1"}
ADJUSTED = "x-tts2face-adjusted"
CANCELLED = (
    "the 2 channels of {} cancel each other, as one is inverted: channel 1 is taken alone, give a file with one "
    "channel to use another one"
)


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("data")


@pytest.fixture(scope="module")
def process() -> SessionProcess:
    """A process that says why a session refuses a request."""
    return SessionProcess(SessionCache(1))


@pytest.fixture(scope="module")
def client(data: Path, process: SessionProcess) -> Iterator[TestClient]:
    """Client of a service with the settings as they are by default, but for its workers."""
    with service_client(ServiceSettings(data=data, workers=0), process) as client, decoding_here():
        yield client


@pytest.fixture
def table(client: TestClient) -> Iterator[TableProcess]:
    """The pool of the service answers from a table for a test."""
    processes = client.app.state.service.pool.processes  # type: ignore[attr-defined]
    before, table = list(processes), TableProcess()
    processes[:] = [table]
    yield table
    processes[:] = before


@pytest.fixture
def official(client: TestClient) -> Any:
    return package("openai").OpenAI(base_url="http://localhost/v1", api_key="unused", max_retries=0, http_client=client)


# What is asked of the pool


def works(client: TestClient, table: TableProcess, **body: Any) -> tuple[Work, str]:
    """The work of a request for speech, and what the answer says of it."""
    answer = client.post("/v1/audio/speech", json=SPEECH | body)
    assert answer.status_code == 200, answer.text
    assert answer.content == body["response_format"].encode()  # that of the table
    return table.works[-1], answer.headers.get(ADJUSTED, "")


@pytest.mark.parametrize(("speed", "used"), [(0.25, 0.5), (0.5, 0.5), (2.0, 2.0), (4.0, 2.0)])
def test_all_speeds_of_openai_are_taken(client: TestClient, table: TableProcess, speed: float, used: float) -> None:
    work, said = works(client, table, speed=speed, response_format="wav")
    assert (f"speed {speed:g} is {used:g}" in said) == (speed != used)
    assert work == works(client, table, speed=used, response_format="wav")[0]
    assert work != works(client, table, response_format="wav")[0]


@pytest.mark.parametrize("model", ["kokoro", "tts-1-hd", "tts-1-1106", "gpt-4o-mini-tts-2025-03-20", "tts2face", "x/y"])
def test_any_model_is_the_default_talker(client: TestClient, table: TableProcess, model: str) -> None:
    work, said = works(client, table, model=model, response_format="pcm")
    assert work == works(client, table, response_format="pcm")[0]
    assert ("model x/y is grid_s1" in said) == (model == "x/y")


def test_a_service_answers_from_its_cache(tmp_path: Path) -> None:
    table, body = TableProcess({"mp4": b"film" * 100}), {"text": "Hello there.", "format": "mp4", "size": "64x64"}
    with service_client(ServiceSettings(cache_mb=10, data=tmp_path, workers=0), table) as client:
        first, second = (client.post("/v1/clips", json=body) for _ in range(2))
        assert first.content == second.content == b"film" * 100
        assert len(table.works) == 1
        lines = client.get("/metrics").text.splitlines()
    assert "tts2face_cache_hits 1.0" in lines
    assert "tts2face_cache_misses 1.0" in lines
    assert [path.stat().st_size > len(first.content) for path in (tmp_path / "cache").iterdir()] == [True]


# What sessions make of it


def test_the_openai_client_gets_the_sound_of_the_clip(official: Any) -> None:
    content = official.audio.speech.create(**SPEECH, response_format="pcm").content
    sound = tts2face.Session().clip(TEXT).speech.waveform
    assert sound.rate == 24_000
    assert np.abs(np.frombuffer(content, "<i2") / 32767 - sound.samples).max() < 1e-4


def test_a_clip_has_the_motion_of_python(client: TestClient, tmp_path: Path) -> None:
    """HTTP gives the same bytes as the same request in Python."""
    options = {"style": "delighted", "seed": 7, "fps": 25}
    session = tts2face.Session()
    path = tmp_path / "clip.curves.jsonl"
    tts2face.export(session.stream(TEXT, **options), path, face=session.face)
    received = client.post("/v1/clips", json={"text": TEXT, "format": "curves", **options})
    assert received.content == path.read_bytes()
    assert received.headers["content-type"].startswith("application/jsonl")


# Refusals


@pytest.mark.parametrize(
    ("body", "status", "reason"),
    [
        ({"text": TEXT, "style": "gleeful"}, 400, "no style 'gleeful'"),
        ({"text": TEXT, "face": "/tmp/me.face"}, 400, "no face '/tmp/me.face'"),
        ({"text": TEXT, "background": "/etc/hostname.png"}, 400, "no background"),
        ({"text": TEXT, "audio": "/etc/passwd"}, 422, "audio: Extra inputs are not permitted"),
        ({"text": TEXT, "fps": 1e9}, 422, "fps: Input should be less than"),
        ({"text": TEXT, "size": "9999x1"}, 400, "size must be"),
        ({"text": "   "}, 400, "nothing to say"),
        ({"text": "x" * 200_000}, 413, "more than 100000 characters"),
        ([], 422, "body"),
    ],
)
def test_wrong_clips_are_refused(client: TestClient, body: object, status: int, reason: str) -> None:
    response = client.post("/v1/clips", json=body)
    assert (response.status_code, reason in response.json()["error"]["message"]) == (status, True), response.text


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"voice": "nobody"}, "there is no voice 'nobody'; the voices are heart"),
        ({"voice": "../../etc/passwd"}, "there is no voice"),
        ({"input": "<speak>Hello <break>.</speak>"}, "close <break>"),
    ],
)
def test_the_openai_client_is_told_what_is_wrong(official: Any, options: dict[str, Any], reason: str) -> None:
    with pytest.raises(package("openai").BadRequestError, match=reason):
        official.audio.speech.create(**{**SPEECH, **options})


@pytest.mark.parametrize(
    ("body", "reason"),
    [
        ({"timestamps": ["word"], "response_format": "mp4"}, "mp4 has no timestamps; choose wav, pcm, mp3"),
        ({"timestamps": ["letter"]}, "timestamps.0: Input should be 'word' or 'phone'"),
        ({"speed": 4.1}, "speed: Input should be less than or equal to 4"),
        ({"voice": "xf_bella"}, "there is no voice 'xf_bella'"),
        ({"lang_code": "xx-none"}, "there is no language 'xx-none'"),
    ],
)
def test_what_is_refused_says_why(client: TestClient, body: dict[str, Any], reason: str) -> None:
    answer = client.post("/v1/audio/speech", json={"input": TEXT, **body})
    assert answer.status_code in {400, 422}
    assert reason in answer.json()["error"]["message"]


@pytest.mark.parametrize(
    ("body", "reason"),
    [
        ({"input": "x" * 501}, "more than 500 characters"),
        ({"input": [{"type": "song", "value": "la"}]}, "no item type 'song'"),
        ({"input": [{"type": "break", "value": "<evil/>"}]}, "no number of milliseconds"),
        ({"input": [{"type": "date", "value": "1e400"}]}, "no milliseconds since 1970"),
        ({"input": "Hi.", "voice": "nobody"}, "no voice 'nobody'"),
    ],
)
def test_wrong_headtts_requests_are_refused(client: TestClient, body: dict[str, object], reason: str) -> None:
    response = client.post("/v1/synthesize", json=body)
    assert response.status_code == 400
    assert reason in response.json()["error"]


def test_a_method_that_a_path_does_not_have_is_refused_with_those_that_it_has(client: TestClient) -> None:
    for method, path, allowed in (
        ("HEAD", "/v1/clips", "POST"), ("PUT", "/v1/voices", "GET, HEAD"), ("PUT", "/v1/jobs", "GET, HEAD, POST"),
        ("OPTIONS", "/v1/talkers/build", "POST"), ("PUT", "/v1/faces/anna", "DELETE, GET, HEAD"),
    ):  # fmt: skip
        answer = client.request(method, path)
        assert (answer.status_code, answer.headers["allow"]) == (405, allowed)


@pytest.mark.parametrize(
    ("files", "reason"),
    [
        ({"audio": wav(0.02)}, "audio"),
        ({"audio": wav(2.0, level=0.0)}, "audio.wav is silent"),
        ({"timeline": b'{"spans": [{"begin": "x"}]}'}, "timeline"),
    ],
    ids=["short", "silent", "timeline"],
)
def test_refusals_show_no_path_of_the_server(
    client: TestClient, data: Path, files: dict[str, bytes], reason: str
) -> None:
    form = {"request": json.dumps({"text": "Hello there.", "format": "curves"})}
    answer = client.post("/v1/clips", data=form, files={name: (name, content) for name, content in files.items()})
    message = answer.json()["error"]["message"]
    assert answer.status_code in {400, 422}, message
    assert reason in message
    assert "/" not in message.replace("and/or", "")
    assert tempfile.gettempdir() not in message
    assert str(data) not in message


def test_what_is_guessed_of_sounds_is_said(client: TestClient, table: TableProcess) -> None:
    files = {"audio": ("a.wav", wav(gains=(1, -1)))}
    answer = client.post("/v1/clips", data={"request": '{"format": "curves"}'}, files=files)
    assert answer.status_code == 200, answer.text
    assert answer.headers[ADJUSTED] == CANCELLED.format("audio")
    job = client.post("/v1/jobs", data={"job": '{"kind": "clip", "request": {}}'}, files=files)
    assert (job.status_code, job.headers[ADJUSTED]) == (202, CANCELLED.format("audio"))
    plain = client.post("/v1/clips", data={"request": '{"format": "curves"}'}, files={"audio": ("a.wav", wav())})
    assert ADJUSTED not in plain.headers


@pytest.mark.parametrize(
    ("form", "files", "status", "reason"),
    [
        ({}, {"audio": ("a.wav", b"no sound")}, 422, "audio cannot be used: it is no sound"),
        ({}, {"background": ("b.png", png_bomb(60_000))}, 422, "background cannot be used: it has 60000 x 60000"),
        ({}, {"timeline": ("t.json", b"{")}, 422, "t"),
        ({}, {"timeline": ("t.json", b"[" * 100_000)}, 422, "t"),
        ({"request": '{"partner": "/etc/passwd"}'}, {"background": ("b.png", png(4, 4))}, 422, "partner"),
        ({}, {"song": ("s.wav", b"x")}, 422, "there is no part 'song'"),
        ({"request": "{"}, {"audio": ("a.wav", wav())}, 422, "JSON"),
        ({"request": "{}", "audio": "text"}, {"background": ("b.png", png(4, 4))}, 422, "audio must be a file"),
    ],
)
def test_wrong_forms_are_refused(
    client: TestClient, form: dict[str, str], files: dict[str, tuple[str, bytes]], status: int, reason: str
) -> None:
    response = client.post("/v1/clips", data={"request": '{"text": "Hello."}'} | form, files=files)
    assert (response.status_code, reason in response.json()["error"]["message"]) == (status, True), response.text


@pytest.mark.parametrize("kind", ["talker", "face", "palette", "dictionary"])
@pytest.mark.parametrize("name", ["nobody", "../../etc/passwd", "/etc/passwd", "x" * 10_000])
def test_unknown_names_are_refused(client: TestClient, kind: str, name: str) -> None:
    answer = client.post("/v1/clips", json={"text": TEXT, "format": "curves", kind: name})
    assert (answer.status_code, f"there is no {kind}" in answer.text, len(answer.text) < 500) == (400, True, True)


# Lists


def test_the_openai_client_lists_models(official: Any) -> None:
    names = [model.id for model in official.models.list()]
    assert names[0] == "grid_s1"
    assert [name for name in names if name in {"grid_s1", "tts-1"}] == ["grid_s1", "tts-1"]


# Results


@pytest.fixture(scope="module")
def stored(client: TestClient) -> dict[str, Any]:
    """The result of a job, which a worker in this process has done."""
    with working(client.app.state.service.settings):  # type: ignore[attr-defined]
        job = finished(client, submit(client, {**CLIP, "format": "wav"}).json())
    assert (job["state"], job["error"]) == ("done", None), job
    return dict(job["results"][0])


@pytest.fixture
def result(stored: dict[str, Any]) -> str:
    """Path of the result."""
    return str(stored["url"])


def test_a_job_is_a_complete_file_with_the_sound_of_its_stream(client: TestClient, result: str) -> None:
    made, streamed = client.get(result).content, client.post("/v1/clips", json={**CLIP, "format": "wav"}).content
    assert samples_of(made) == samples_of(streamed)
    with wave.open(io.BytesIO(made)) as sound:
        assert 2 * sound.getnframes() == len(samples_of(made))


@pytest.mark.parametrize("given", ["bytes=abc", "bytes=5-2", "bytes=", "bytes=-", "lines=0-1", "0-1", "bytes=0-1,x"])
def test_a_range_of_no_valid_form_is_ignored(client: TestClient, result: str, given: str) -> None:
    whole = client.get(result)
    answer = client.get(result, headers={"range": given})
    assert (answer.status_code, answer.content) == (200, whole.content)


def test_ranges_are_answered(client: TestClient, result: str) -> None:
    whole = client.get(result).content
    for given, part in (("bytes=0-3", whole[:4]), ("Bytes = 4-", whole[4:]), ("bytes=-5", whole[-5:])):
        answer = client.get(result, headers={"range": given})
        assert (answer.status_code, answer.content) == (206, part)
    beyond = client.get(result, headers={"range": f"bytes={len(whole)}-"})
    assert (beyond.status_code, beyond.headers["content-range"]) == (416, f"bytes */{len(whole)}")


def test_results_are_immutable_files_with_parts(client: TestClient, stored: dict[str, Any]) -> None:
    result, name = stored["url"], stored["sha256"]
    whole = client.get(result)
    assert len(whole.content) == stored["bytes"]
    assert whole.headers["etag"] == f'"{name}"'
    assert "immutable" in whole.headers["cache-control"]
    assert whole.headers["content-disposition"] == 'attachment; filename="clip.wav"'
    assert client.get(result, headers={"Range": "bytes=10-", "If-Range": '"other"'}).status_code == 200
    unchanged = client.get(result, headers={"If-None-Match": f'"x", W/"{name}"'})
    assert (unchanged.status_code, unchanged.content) == (304, b"")
    for wrong in ("0" * 64, "..%2F..%2Fetc%2Fpasswd", name.upper()):
        assert client.get(f"/v1/results/{wrong}").status_code == 404


def test_head_of_a_result(client: TestClient, result: str) -> None:
    asked = client.head(result)
    assert int(asked.headers["content-length"]) == len(client.get(result).content)
    assert asked.headers["etag"]
