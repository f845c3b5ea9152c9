"""A running service, one for each process of the tests."""

import json
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import httpx
import pytest

START_TIMEOUT_S = 180.0


class RunningService:
    """A ``tts2face serve`` process, its address, and its log, which a thread reads.

    Parameters
    ----------
    environment
        Further variables, such as TTS2FACE_SERVE_BODY_S.
    program
        Arguments of Python that run the command line.
    """

    def __init__(
        self,
        *arguments: str,
        environment: Mapping[str, str] | None = None,
        program: Sequence[str] = ("-m", "tts2face"),
        processes: int = 1,
    ) -> None:
        command = [sys.executable, *program, "serve", "--port", "0", *arguments]
        command += ["--processes", str(processes)]
        # NiceGUI takes part in tests of its own where it finds pytest's variables.
        removed = ("TTS2FACE_SERVE_", "OTEL_", "PYTEST")
        kept = {name: value for name, value in os.environ.items() if not name.startswith(removed)}
        self.data = tempfile.TemporaryDirectory(prefix="tts2face-service-")
        self.process = subprocess.Popen(
            command, stderr=subprocess.PIPE, text=True,
            # Most tests show no face.
            env=kept | {"TTS2FACE_SERVE_DATA": self.data.name, "TTS2FACE_SERVE_WARM_STUDIO": "false"}
            | dict(environment or {}),
        )  # fmt: skip
        self.lines: list[str] = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        self.url: str = self.wait_for_event("listening")["url"]

    def _read(self) -> None:
        assert self.process.stderr is not None
        with self.process.stderr as file:
            for line in file:
                self.lines.append(line)

    def events(self) -> list[dict[str, Any]]:
        """The lines of the log."""
        return [json.loads(line) for line in list(self.lines)]

    def wait_for_event(self, name: str, **fields: Any) -> dict[str, Any]:
        """The first line of the log with this event and these fields."""
        deadline = time.monotonic() + START_TIMEOUT_S
        while True:
            for event in self.events():
                if event["event"] == name and fields.items() <= event.items():
                    return event
            assert self.process.poll() is None or self._reader.is_alive(), "".join(self.lines)
            assert time.monotonic() < deadline, f"no event {name}: {''.join(self.lines)[-3000:]}"
            time.sleep(0.02)

    def wait_until_ready(self) -> None:
        deadline = time.monotonic() + START_TIMEOUT_S
        while httpx.get(f"{self.url}/readyz").status_code != 200:
            assert time.monotonic() < deadline, "the service did not become ready"
            time.sleep(0.1)

    def close(self) -> str:
        """End the process; its log."""
        if self.process.poll() is None:
            self.process.terminate()
        self.process.wait(timeout=90)
        self._reader.join(timeout=60)
        self.data.cleanup()
        return "".join(self.lines)


@contextmanager
def running_service(*arguments: str, is_ready: bool = True, **options: Any) -> Iterator[RunningService]:
    """A service that ends with the block; `is_ready`: with its synthesis processes; parameters as `RunningService`."""
    running = RunningService(*arguments, **options)
    try:
        if is_ready:
            running.wait_until_ready()
        yield running
    finally:
        running.close()


@pytest.fixture(scope="session")
def service() -> Iterator[RunningService]:
    with running_service() as running:
        yield running


@pytest.fixture
def client(service: RunningService) -> Iterator[httpx.Client]:
    with httpx.Client(base_url=service.url, timeout=60.0) as made:
        yield made
