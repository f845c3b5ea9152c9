"""Running services: those of the host, which share its pool, and those with a process of their own."""

import json
import os
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from importlib.util import find_spec
from itertools import count
from pathlib import Path
from typing import Any

import httpx
import pytest

START_TIMEOUT_S = 180.0
PREFIX = "TTS2FACE_SERVE_"  # of variables with settings
# NiceGUI takes part in tests of its own where it finds pytest's variables.
REMOVED = (PREFIX, "OTEL_", "PYTEST")
TABLE_PROGRAM = ("-m", "tests.serving.service.table_synthesis")  # a service whose synthesis processes load no models
HostService = Callable[..., "AbstractContextManager[HostedService]"]


def eventually(condition: Callable[[], Any], seconds: float = 60.0, what: str | Callable[[], str] = "") -> Any:
    """The first true value of a condition; the test fails, and says `what`, if there is none within some seconds."""
    deadline, pause_s = time.monotonic() + seconds, 0.02
    while not (found := condition()):
        assert time.monotonic() < deadline, f"not within {seconds:g} s: {what() if callable(what) else what}"
        time.sleep(pause_s)
        pause_s = min(1.3 * pause_s, 0.2)
    return found


def free_port() -> int:
    """A port of this machine on which nothing listens."""
    with socket.create_server(("127.0.0.1", 0)) as probe:
        return int(probe.getsockname()[1])


class Log:
    """A log of lines of JSON."""

    lines: Sequence[str]

    def events(self) -> list[dict[str, Any]]:
        """The lines of the log."""
        return [json.loads(line) for line in list(self.lines)]


class LoggedProcess(Log):
    """A process of Python whose log a thread reads from its standard error."""

    def __init__(self, *arguments: str, environment: Mapping[str, str]) -> None:
        kept = {name: value for name, value in os.environ.items() if not name.startswith(REMOVED)}
        self.process = subprocess.Popen(
            [sys.executable, *arguments], stdin=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
            env=kept | dict(environment),
        )  # fmt: skip
        self.lines: list[str] = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        assert self.process.stderr is not None
        with self.process.stderr as file:
            for line in file:
                self.lines.append(line)

    def wait_for_event(self, name: str, **fields: Any) -> dict[str, Any]:
        """The first line of the log with this event and these fields."""

        def find() -> dict[str, Any] | None:
            found = (event for event in self.events() if event["event"] == name and fields.items() <= event.items())
            event = next(found, None)
            assert event or self.process.poll() is None or self._reader.is_alive(), "".join(self.lines)
            return event

        wanted = f"no event {name} {fields}: "
        event: dict[str, Any] = eventually(find, START_TIMEOUT_S, lambda: wanted + "".join(self.lines)[-3000:])
        return event

    def end(self) -> str:
        """End the process; its log."""
        if self.process.poll() is None:
            self.process.terminate()
        self.process.wait(timeout=90)
        self._reader.join(timeout=60)
        assert self.process.stdin is not None
        self.process.stdin.close()
        return "".join(self.lines)


class RunningService(Log):
    """A service with an address, a log and a folder of data."""

    url: str
    data: "tempfile.TemporaryDirectory[str]"
    process: "subprocess.Popen[str]"

    def variables(self, environment: Mapping[str, str]) -> dict[str, str]:
        """Variables with the settings: a folder of data, no face of the studio, which most tests do not show."""
        self.data = tempfile.TemporaryDirectory(prefix="tts2face-service-")
        return {f"{PREFIX}DATA": self.data.name, f"{PREFIX}WARM_STUDIO": "false"} | dict(environment)

    def wait_until_ready(self) -> None:
        eventually(self._is_ready, START_TIMEOUT_S)

    def _is_ready(self) -> bool:
        try:
            return all(httpx.get(f"{self.url}/readyz").json()["checks"].values())
        except httpx.TimeoutException:  # the machine is busy
            return False


class ServeProcess(LoggedProcess, RunningService):
    """A ``tts2face serve`` process, for tests of processes: signals, kills, memory, the environment.

    Parameters
    ----------
    environment
        Further variables, such as TTS2FACE_SERVE_BODY_S.
    program
        Arguments of Python that run the command line.
    processes
        Number of synthesis processes.
    """

    def __init__(
        self,
        *arguments: str,
        environment: Mapping[str, str] | None = None,
        program: Sequence[str] = ("-m", "tts2face"),
        processes: int = 1,
    ) -> None:
        command = [*program, "serve", "--port", "0", "--processes", str(processes), *arguments]
        super().__init__(*command, environment=self.variables(environment or {}))
        self.url = self.wait_for_event("listening")["url"]

    def close(self) -> str:
        """End the process; its log."""
        log = self.end()
        self.data.cleanup()
        return log


@contextmanager
def serve_process(*arguments: str, is_ready: bool = True, **options: Any) -> Iterator[ServeProcess]:
    """A service that ends with the block; `is_ready`: with its synthesis processes; parameters as `ServeProcess`."""
    with _until_the_end(ServeProcess(*arguments, **options), is_ready=is_ready) as running:
        yield running


@contextmanager
def _until_the_end(running: Any, *, is_ready: bool) -> Iterator[Any]:
    try:
        if is_ready:
            running.wait_until_ready()
        yield running
    finally:
        running.close()


class HostedService(RunningService):
    """A service of the host.

    Parameters
    ----------
    host
        A process of `tests.serving.service.host`.
    number
        Of the service in the host.
    studio
        With the studio and the harness; one service of a host has them.
    """

    def __init__(self, host: LoggedProcess, number: int, environment: Mapping[str, str], *, studio: bool) -> None:
        self.host, self._number, self._begin = host, number, len(host.lines)
        self._order({"number": number, "variables": self.variables(environment), "studio": studio})
        self.url: str = host.wait_for_event("started", number=number)["url"]

    @property
    def process(self) -> "subprocess.Popen[str]":
        """The process of the host."""
        return self.host.process

    @property
    def lines(self) -> list[str]:
        """Lines of the host's log since the service started."""
        return self.host.lines[self._begin :]

    def wait_for_event(self, name: str, **fields: Any) -> dict[str, Any]:
        """The first line of the host's log with this event and these fields."""
        return self.host.wait_for_event(name, **fields)

    def close(self) -> None:
        """End the service when its requests are done."""
        self._order({"end": self._number})
        self.host.wait_for_event("ended", number=self._number)
        self.data.cleanup()

    def _order(self, order: dict[str, Any]) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(json.dumps(order) + "\n")
        self.process.stdin.flush()


@pytest.fixture(scope="session")
def host(tmp_path_factory: pytest.TempPathFactory) -> Iterator[HostService]:
    """Function that starts services of this run of the tests; they share one pool of warm processes.

    Its parameters are the settings by their names in lower case: ``host(body_s=2)``. Other names in upper case are
    environment variables.
    """
    folder, numbers = tmp_path_factory.mktemp("harness"), count(1)
    process = LoggedProcess(
        "-m", "tests.serving.service.host", str(folder), environment={"PYTHONPATH": str(Path.cwd())}
    )

    @contextmanager
    def start(*, studio: bool = False, is_ready: bool = True, **settings: Any) -> Iterator[HostedService]:
        names = {name if name.isupper() else PREFIX + name.upper(): str(value) for name, value in settings.items()}
        running = HostedService(process, next(numbers), names, studio=studio)
        with _until_the_end(running, is_ready=is_ready):
            yield running

    yield start
    process.end()


@pytest.fixture(scope="session")
def service(host: HostService) -> Iterator[HostedService]:
    """A service with the settings as they are by default, with studio and harness."""
    with host(studio=find_spec("nicegui") is not None) as running:
        yield running


@pytest.fixture
def client(service: HostedService) -> Iterator[httpx.Client]:
    with httpx.Client(base_url=service.url, timeout=60.0) as made:
        yield made
