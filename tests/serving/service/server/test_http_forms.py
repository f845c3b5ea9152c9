"""HEAD on the wire: as GET, without a body."""

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
