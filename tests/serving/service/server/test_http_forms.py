"""Forms of HTTP that clients use: HEAD, ranges of any form, refusals without paths of the server, a killed process."""

import io
import json
import tempfile
import wave

import httpx
import pytest

from tests.running import RunningService
from tests.serving.service import raw
from tests.serving.service.job_requests import CLIP, finished, submit

RESULT = {**CLIP, "format": "wav"}


@pytest.fixture(scope="module")
def result(service: RunningService) -> str:
    """Path of a result."""
    with httpx.Client(base_url=service.url, timeout=60.0) as api:
        job = finished(api, submit(api, RESULT).json())
        return str(job["results"][0]["url"])


@pytest.mark.parametrize("path", ["/healthz", "/readyz", "/v1/voices", "/v1/faces/head", "/docs", "/v1/nothing"])
def test_head_is_get_without_the_body(service: RunningService, client: httpx.Client, path: str) -> None:
    got = client.get(path)
    asked = raw.ask(service.url, raw.head("HEAD", path))
    assert (asked.status, asked.body) == (got.status_code, b"")
    assert asked.headers["content-type"] == got.headers["content-type"]
    assert asked.headers["content-length"] == got.headers["content-length"]


def test_head_of_a_result_and_of_events(service: RunningService, client: httpx.Client, result: str) -> None:
    asked = client.head(result)
    assert int(asked.headers["content-length"]) == len(client.get(result).content)
    assert asked.headers["etag"]
    job = submit(client, {**RESULT, "text": "One. " * 200}).json()
    events = client.head(f"/v1/jobs/{job['id']}/events", timeout=5)  # whose body ends with the job
    assert events.headers["content-type"].startswith("text/event-stream")
    client.post(f"/v1/jobs/{job['id']}/cancel")
    request = service.wait_for_event("request", method="HEAD", path="/v1/jobs/{job_id}/events")
    assert (request["status"], request["bytes"]) == (200, 0)


def test_a_method_that_a_path_does_not_have_is_refused_with_those_that_it_has(client: httpx.Client) -> None:
    for method, path, allowed in (
        ("HEAD", "/v1/clips", "POST"), ("PUT", "/v1/voices", "GET, HEAD"), ("PUT", "/v1/jobs", "GET, HEAD, POST"),
        ("OPTIONS", "/v1/talkers/build", "POST"), ("PUT", "/v1/faces/anna", "DELETE, GET, HEAD"),
    ):  # fmt: skip
        answer = client.request(method, path)
        assert (answer.status_code, answer.headers["allow"]) == (405, allowed)


@pytest.mark.parametrize("given", ["bytes=abc", "bytes=5-2", "bytes=", "bytes=-", "lines=0-1", "0-1", "bytes=0-1,x"])
def test_a_range_of_no_valid_form_is_ignored(client: httpx.Client, result: str, given: str) -> None:
    whole = client.get(result)
    answer = client.get(result, headers={"range": given})
    assert (answer.status_code, answer.content) == (200, whole.content)


def test_ranges_are_answered(client: httpx.Client, result: str) -> None:
    whole = client.get(result).content
    for given, part in (("bytes=0-3", whole[:4]), ("Bytes = 4-", whole[4:]), ("bytes=-5", whole[-5:])):
        answer = client.get(result, headers={"range": given})
        assert (answer.status_code, answer.content) == (206, part)
    beyond = client.get(result, headers={"range": f"bytes={len(whole)}-"})
    assert (beyond.status_code, beyond.headers["content-range"]) == (416, f"bytes */{len(whole)}")


def sound(seconds: float) -> bytes:
    file = io.BytesIO()
    with wave.open(file, "wb") as out:
        out.setnchannels(1)
        out.setsampwidth(2)
        out.setframerate(16_000)
        out.writeframes(bytes(2 * round(16_000 * seconds)))
    return file.getvalue()


@pytest.mark.parametrize(
    ("files", "reason"),
    [
        ({"audio": sound(0.02)}, "audio"),
        ({"audio": sound(2.0)}, "audio.wav is silent"),
        ({"timeline": b'{"spans": [{"begin": "x"}]}'}, "timeline"),
    ],
    ids=["short", "silent", "timeline"],
)
def test_refusals_show_no_path_of_the_server(
    service: RunningService, client: httpx.Client, files: dict[str, bytes], reason: str
) -> None:
    form = {"request": json.dumps({"text": "Hello there.", "format": "curves"})}
    answer = client.post("/v1/clips", data=form, files={name: (name, content) for name, content in files.items()})
    message = answer.json()["error"]["message"]
    assert answer.status_code in {400, 422}, message
    assert reason in message
    assert "/" not in message.replace("and/or", "")
    assert tempfile.gettempdir() not in message
    assert service.data.name not in message
