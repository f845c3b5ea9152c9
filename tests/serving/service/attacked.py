"""A server with small limits that hostile requests are sent to; after each of them it is ready and speaks."""

from collections.abc import Iterator

import httpx
import pytest

from tests.running import HostService, RunningService

SPEECH = "/v1/audio/speech"
SETTINGS = {"head_s": 1.5, "body_s": 2, "stall_s": 2, "body_mb": 2, "sound_s": 20, "message_kb": 64, "workers": 0}


@pytest.fixture(scope="module")
def attacked(host: HostService) -> Iterator[RunningService]:
    with host(**SETTINGS) as running:
        yield running
    assert not [event for event in running.events() if event["event"] == "defect"]


@pytest.fixture(autouse=True)
def alive(attacked: RunningService) -> Iterator[None]:
    """After every attack the server is ready and speaks."""
    yield
    assert httpx.get(f"{attacked.url}/readyz", timeout=60).status_code == 200
    assert say(attacked, "Hello.").status_code == 200


def say(service: RunningService, text: str) -> httpx.Response:
    body = {"input": text, "model": "tts-1", "voice": "alloy", "response_format": "pcm"}
    return httpx.post(service.url + SPEECH, json=body, timeout=60)
