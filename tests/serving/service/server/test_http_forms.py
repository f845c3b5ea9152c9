"""HEAD on the wire: as GET, without a body."""

import json

import httpx
import pytest

from tests.running import RunningService
from tests.serving.service import raw
from tests.serving.service.job_requests import CLIP, submit


@pytest.mark.parametrize("path", ["/healthz", "/readyz", "/v1/voices", "/v1/faces/head", "/docs", "/v1/nothing"])
def test_head_is_get_without_the_body(service: RunningService, client: httpx.Client, path: str) -> None:
    got = client.get(path)
    asked = raw.ask(service.url, raw.head("HEAD", path))
    assert (asked.status, asked.body) == (got.status_code, b"")
    assert asked.headers["content-type"] == got.headers["content-type"]
    assert asked.headers["content-length"] == got.headers["content-length"]


def test_head_of_events(service: RunningService, client: httpx.Client) -> None:
    job = submit(client, {**CLIP, "text": "One. " * 200}).json()
    events = client.head(f"/v1/jobs/{job['id']}/events", timeout=5)  # whose body ends with the job
    assert events.headers["content-type"].startswith("text/event-stream")
    client.post(f"/v1/jobs/{job['id']}/cancel")
    request = service.wait_for_event("request", method="HEAD", path="/v1/jobs/{job_id}/events")
    assert (request["status"], request["bytes"]) == (200, 0)


@pytest.mark.parametrize("format", ["mp4", "webm", "mp3", "wav", "curves", "livelink"])
def test_a_nod_beyond_the_clip_is_refused_before_the_first_byte(client: httpx.Client, format: str) -> None:
    form = {"request": json.dumps({"text": "Hello there. Good bye.", "size": "64x64", "format": format})}
    answer = client.post("/v1/clips", data=form, files={"timeline": json.dumps({"nods": [{"time": 60}]}).encode()})
    assert answer.status_code == 400
    assert "the nod at 60 s lies beyond the clip" in answer.json()["error"]["message"]
