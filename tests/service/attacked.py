"""A server with small limits that hostile requests are sent to; after each of them it is ready and speaks."""

from collections.abc import Iterator

import httpx
import pytest

from tests.service.conftest import RunningService

SPEECH = "/v1/audio/speech"
SETTINGS = {"HEAD_S": "1.5", "BODY_S": "2", "STALL_S": "2", "BODY_MB": "2", "SOUND_S": "20", "MESSAGE_KB": "64"}


@pytest.fixture(scope="module")
def attacked() -> Iterator[RunningService]:
    running = RunningService(environment={f"TTS2FACE_SERVE_{name}": value for name, value in SETTINGS.items()})
    try:
        running.wait_until_ready()
        yield running
    finally:
        log = running.close()
    assert running.process.returncode == 0, log[-3000:]
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
