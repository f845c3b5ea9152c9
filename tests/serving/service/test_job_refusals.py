"""Jobs that are refused: of other keys, beyond limits, with wrong options or files, and hooks of other hosts."""

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest
from starlette.testclient import TestClient

from tests.serving.service.in_process import TableProcess, decoding_here, service_client, with_key
from tests.serving.service.job_requests import CLIP, SMALL, submit
from tts2face.serving.service.job_kinds.table import JOB_KINDS
from tts2face.serving.service.keys import add_key
from tts2face.serving.service.settings import ServiceSettings

HOST = "hooks.example"  # the only one that may be told
Clients = dict[str, TestClient]


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("data")


@pytest.fixture(scope="module")
def idle(data: Path) -> Iterator[Clients]:
    """Clients of the keys of a service without workers, with small limits."""
    keys = data / "keys.toml"
    scopes = {"ann": ["speak"], "bob": ["speak"], "boss": ["speak", "admin"], "smith": ["build"]}
    secrets = {name: add_key(keys, name, found) for name, found in scopes.items()}
    for name in ("quick", "pausing"):
        secrets[name] = add_key(keys, name, ["speak"], speech_s_per_day=10)
    settings = ServiceSettings(
        data=data, keys=keys, workers=0, job_waiting=3, job_cues=3, job_files=2, job_s=60, text_characters=500,
        webhook_hosts=(HOST,), webhook_secret="x" * 32,
    )  # fmt: skip
    with service_client(settings, TableProcess()) as client, decoding_here():
        yield {name: with_key(client, secret) for name, secret in secrets.items()}


def test_a_key_sees_its_own_jobs_only(idle: Clients) -> None:
    ann, bob, boss = idle["ann"], idle["bob"], idle["boss"]
    job = submit(ann, CLIP).json()
    other = submit(bob, CLIP).json()
    assert [one["id"] for one in ann.get("/v1/jobs").json()["jobs"]] == [job["id"]]
    assert [one["id"] for one in boss.get("/v1/jobs").json()["jobs"]] == [other["id"], job["id"]]
    first = boss.get("/v1/jobs", params={"limit": 1, "state": "waiting"}).json()
    second = boss.get("/v1/jobs", params={"limit": 1, "before": first["next"]}).json()
    assert [one["id"] for one in (*first["jobs"], *second["jobs"])] == [other["id"], job["id"]]
    assert second["next"] is None
    calls: tuple[Callable[..., httpx.Response], ...] = (bob.get, bob.delete)
    for call in calls:
        assert call(f"/v1/jobs/{job['id']}").status_code == 404
    assert bob.post(f"/v1/jobs/{job['id']}/cancel").status_code == 404
    assert bob.get(f"/v1/jobs/{job['id']}/events").status_code == 404
    assert boss.get(f"/v1/jobs/{job['id']}").status_code == 200
    answer = submit(idle["smith"], CLIP)
    assert (answer.status_code, answer.json()["error"]["code"]) == (403, "forbidden")
    for client, one in ((ann, job), (bob, other)):
        assert client.delete(f"/v1/jobs/{one['id']}").status_code == 204


def test_waiting_jobs_of_a_key_are_limited(idle: Clients) -> None:
    made = [submit(idle["ann"], CLIP) for _ in range(4)]
    assert [one.status_code for one in made] == [202, 202, 202, 429]
    assert int(made[-1].headers["retry-after"]) > 0
    other = submit(idle["bob"], CLIP)
    assert other.status_code == 202
    for one in made[:3]:
        assert idle["ann"].delete(one.headers["location"]).status_code == 204
    idle["bob"].delete(other.headers["location"])


@pytest.mark.parametrize(
    ("body", "status", "reason"),
    [
        ({"kind": "fly"}, 422, f"no job of kind 'fly' here; the kinds are {', '.join(JOB_KINDS)}"),
        ({"kind": "clip"}, 400, "nothing to say"),
        ({"kind": "clip", "request": {**CLIP, "speed": 2}}, 422, "speed: Extra inputs are not permitted"),
        ({"kind": "clip", "request": {**CLIP, "voice": "../x.onnx"}}, 400, "no voice '../x.onnx'"),
        ({"kind": "clip", "request": {**CLIP, "talker": "/etc/passwd"}}, 400, "no talker '/etc/passwd'"),
        ({"kind": "clip", "request": {**CLIP, "size": "3x3"}}, 400, "size must be"),
        ({"kind": "clip", "request": {**CLIP, "language": "Klingonese"}}, 400, "language"),
        ({"kind": "clip", "request": {**CLIP, "text": "x" * 501}}, 413, "more than 500 characters"),
        ({"kind": "clip", "request": CLIP, "priority": 1}, 422, "priority: Extra inputs"),
        ({"kind": "subtitles", "request": SMALL}, 422, "there are no subtitles"),
        ({"kind": "subtitles", "request": {**SMALL, "exports": ["exe"]}}, 422, "no subtitles"),
        ([], 422, "body"),
    ],
)
def test_wrong_jobs_are_refused(idle: Clients, body: object, status: int, reason: str) -> None:
    answer = idle["ann"].post("/v1/jobs", json=body)
    assert (answer.status_code, reason in answer.json()["error"]["message"]) == (status, True), answer.text


def role(**settings: str) -> dict[str, Any]:
    """Options with a cast."""
    return {"cast": {"role": [{"speaker": "ANN", **settings}]}}


def cues(number: int, at: int = 0) -> bytes:
    return "\n".join(
        f"{n + 1}\n00:00:{at + n:02d},000 --> 00:00:{at + n + 1:02d},000\nWords.\n" for n in range(number)
    ).encode()


@pytest.mark.parametrize(
    ("request_", "files", "status", "reason"),
    [
        ({}, [("subtitles", b"\x00\x01")], 422, "contains no subtitles"),
        ({}, [("subtitles", b'<!DOCTYPE tt [<!ENTITY a "b">]><tt>&a;</tt>')], 422, "subtitles-001 cannot"),
        ({}, [("subtitles", cues(4))], 422, "4 cues, more than 3"),
        ({}, [("subtitles", cues(2)), ("subtitles", cues(2))], 413, "more than 3 cues"),
        ({}, [("subtitles", cues(1))] * 3, 413, "more than 2 subtitle files"),
        ({}, [("subtitles", cues(1).replace(b"00:00:01", b"01:00:01"))], 413, "longer than 60 s"),
        ({}, [("subtitles", cues(1)), ("audio", b"no sound")], 422, "audio-001 cannot be used"),
        ({}, [("subtitles", cues(1)), ("timeline", b"{}")], 422, "there is no part 'timeline'"),
        ({"encoding": "klingon"}, [("subtitles", b"\xff\xfe\xfd")], 422, "klingon"),
        ({"exports": ["exe"]}, [("subtitles", cues(1))], 400, "exe"),
        ({"cast": "[[role"}, [("subtitles", cues(1))], 422, "cast is not TOML"),
        (role(talker="/etc/passwd"), [("subtitles", cues(1))], 400, "no talker"),
        (role(voice="x.onnx"), [("subtitles", cues(1))], 400, "no voice"),
        (role(dictionary="/etc/passwd"), [("subtitles", cues(1))], 400, "no dictionary"),
        (role(shell="rm"), [("subtitles", cues(1))], 422, "no setting 'shell'"),
        ({"background": "transparent"}, [("subtitles", cues(1))], 400, "no transparency"),
        ({}, [("subtitles", cues(1)), ("lines", b"rate\n1.2\n")], 422, "lines: there is no column cue"),
        ({}, [("subtitles", cues(1)), ("lines", b"cue,rate\n1,fast\n")], 422, "lines, line 2: 'fast' is not a number"),
        ({}, [("subtitles", cues(1)), ("lines", b"\xff\xfe\xfd")], 422, "lines"),
        ({}, [("subtitles", cues(1)), ("lines", b"cue,voice\n1,/etc/x.onnx\n")], 400, "no voice"),
        ({"min_rate": 0.2}, [("subtitles", cues(1))], 422, "min_rate"),
    ],
)  # fmt: skip
def test_wrong_subtitle_jobs_are_refused(
    idle: Clients, data: Path, request_: dict[str, Any], files: list[tuple[str, bytes]], status: int, reason: str,
) -> None:  # fmt: skip
    form = {"job": json.dumps({"kind": "subtitles", "request": {**SMALL, **request_}})}
    answer = idle["ann"].post("/v1/jobs", data=form, files=files)
    assert (answer.status_code, reason in answer.json()["error"]["message"]) == (status, True), answer.text
    assert str(data) not in answer.text
    assert "/tmp" not in answer.text


@pytest.mark.parametrize(
    "url",
    ["http://169.254.169.254/latest", "https://example.org/", "file:///etc/passwd", "http://{host}@example.org/",
     "http://example.org@{host}/", "http://{host}.example.org/", "//{host}/", "http://[/", "http://{host}/a b"],
)  # fmt: skip
def test_webhooks_to_other_hosts_are_refused(idle: Clients, url: str) -> None:
    answer = idle["ann"].post(
        "/v1/jobs", json={"kind": "clip", "request": CLIP, "webhook": url.replace("{host}", HOST)}
    )
    assert (answer.status_code, answer.json()["error"]["code"]) == (400, "invalid_webhook")


def test_jobs_use_the_seconds_of_speech_too(idle: Clients) -> None:
    """By their texts, as they are made later and elsewhere."""
    job = {"kind": "clip", "request": {"text": "We were away a year ago. " * 12}}
    answers = [idle["quick"].post("/v1/jobs", json=job) for _ in range(2)]
    assert [answer.status_code for answer in answers] == [202, 429], answers[0].text
    assert int(answers[1].headers["retry-after"]) > 3600
    pauses = {"kind": "clip", "request": {"text": "a [pause 9] b [pause 9] c"}}  # 2 s of letters
    assert [idle["pausing"].post("/v1/jobs", json=pauses).status_code for _ in range(2)] == [202, 429]
