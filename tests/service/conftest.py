"""A running service, one for each process of the tests."""

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator

import httpx
import pytest

START_TIMEOUT_S = 180.0


class RunningService:
    """A ``tts2face serve`` process and its address."""

    def __init__(self, *arguments: str) -> None:
        command = [sys.executable, "-m", "tts2face", "serve", "--port", "0", "--processes", "1", *arguments]
        self.data = tempfile.TemporaryDirectory(prefix="tts2face-service-")
        environment = {"TTS2FACE_SERVE_DATA": self.data.name} | {
            name: value for name, value in os.environ.items() if not name.startswith("TTS2FACE_SERVE_")
        }
        self.process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=environment)
        assert self.process.stderr is not None
        line = self.process.stderr.readline()
        self.url: str = json.loads(line)["url"]

    def wait_until_ready(self) -> None:
        deadline = time.monotonic() + START_TIMEOUT_S
        while httpx.get(f"{self.url}/readyz").status_code != 200:
            assert time.monotonic() < deadline, "the service did not become ready"
            time.sleep(0.1)

    def close(self) -> str:
        """End the process; the rest of its log."""
        self.process.terminate()
        _, log = self.process.communicate(timeout=60)
        self.data.cleanup()
        return log


@pytest.fixture(scope="session")
def service() -> Iterator[RunningService]:
    running = RunningService()
    try:
        running.wait_until_ready()
        yield running
    finally:
        running.close()


@pytest.fixture
def client(service: RunningService) -> Iterator[httpx.Client]:
    with httpx.Client(base_url=service.url, timeout=60.0) as made:
        yield made
