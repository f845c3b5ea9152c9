"""Databases of jobs: a SQLite file, and PostgreSQL if it is installed; workers that can be killed."""

import contextlib
import os
import shutil
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from tempfile import mkdtemp

import pytest

from tests.packages import needs, reason

pytest.importorskip("dbos", reason=reason("dbos"))

from tests.running import eventually
from tests.started import children
from tts2face.serving.batch.segment import Segment, input_hashes
from tts2face.session.named_models import Models

ROOT = Path(__file__).parents[3]
FOLDERS = sorted(Path("/usr/lib/postgresql").glob("*/bin"), reverse=True)
StartWorker = Callable[..., "subprocess.Popen[bytes]"]


class Postgres:
    """A server in a temporary folder; a superuser starts it as the user postgres.

    Parameters
    ----------
    settings
        Options of the server.
    """

    def __init__(self, settings: str = "-F") -> None:
        found = shutil.which("initdb")
        folder = Path(found).resolve().parent if found else next(iter(FOLDERS), None)
        if folder is None:
            pytest.skip("PostgreSQL is not installed (apt install postgresql)")
        self._as_user = ["runuser", "-u", "postgres", "--"] if os.getuid() == 0 else []
        if self._as_user and shutil.which("runuser") is None:
            pytest.skip("PostgreSQL does not run as a superuser, and runuser is missing")
        self._bin, self._settings = folder, settings
        self.folder = Path(mkdtemp(prefix="tts2face-pg-"))
        if self._as_user:
            shutil.chown(self.folder, "postgres")
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        self.has_started = False
        self.run("initdb", "-D", str(self.folder / "data"), "-A", "trust", "-U", "tts2face", "--no-sync")
        self.start()
        self.n_databases, self.has_started = 0, True

    def run(self, command: str, *arguments: str) -> None:
        """Run a program of PostgreSQL."""
        answer = subprocess.run(
            [*self._as_user, str(self._bin / command), *arguments], capture_output=True, text=True, check=False, cwd="/"
        )
        if answer.returncode:
            log = self.folder / "log"
            said = (answer.stderr or answer.stdout) + (log.read_text()[-900:] if log.is_file() else "")
            reason = f"PostgreSQL does not start here: {said.strip()}"
            if self.has_started:
                pytest.fail(reason)
            pytest.skip(reason)

    def start(self) -> None:
        options = f"-p {self.port} -k {self.folder} -h 127.0.0.1 {self._settings}"
        self.run(
            "pg_ctl", "-D", str(self.folder / "data"), "-w", "-o", options, "-l", str(self.folder / "log"), "start"
        )

    def stop(self, mode: str = "immediate") -> None:
        self.run("pg_ctl", "-D", str(self.folder / "data"), "-m", mode, "-w", "stop")

    def kill(self) -> None:
        """Kill the server and its processes, as `kill -9` does."""
        os.kill(self.processes()[0], signal.SIGSTOP)  # it starts no process that would be missed
        family = self.processes()
        for number in family:
            with contextlib.suppress(ProcessLookupError):
                os.kill(number, signal.SIGKILL)
        # A server does not start while the number of the earlier one is in use, be it by a zombie.
        eventually(lambda: not any(Path(f"/proc/{number}").exists() for number in family))

    def processes(self) -> list[int]:
        """Numbers of the processes of the server."""
        main = int((self.folder / "data" / "postmaster.pid").read_text().split()[0])
        return [main, *children(main)]

    def put(self, path: Path) -> Path:
        """A copy of a file that the server's user can read."""
        copy = shutil.copyfile(path, self.folder / path.name)
        copy.chmod(0o644)
        return copy

    def remove(self) -> None:
        """End the server and remove its files."""
        self.stop()
        shutil.rmtree(self.folder, ignore_errors=True)

    def database(self) -> str:
        """URL of a new database."""
        self.n_databases += 1
        name = f"jobs{self.n_databases}"
        server = f"postgresql://tts2face@127.0.0.1:{self.port}"
        import psycopg

        with psycopg.connect(f"{server}/postgres", autocommit=True) as connection:
            connection.execute(f"CREATE DATABASE {name}")
        return f"{server}/{name}"


@pytest.fixture(scope="session")
def postgres() -> Iterator[Postgres]:
    needs("psycopg")
    server = Postgres()
    yield server
    server.remove()


@pytest.fixture(params=["sqlite", pytest.param("postgres", marks=pytest.mark.server)])
def database(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    """An empty database of either kind."""
    if request.param == "sqlite":
        return str(tmp_path / "jobs.sqlite")
    url: str = request.getfixturevalue("postgres").database()
    return url


@pytest.fixture
def start_worker(tmp_path: Path) -> Iterator[StartWorker]:
    """Starts workers of `tests.serving.work.stub_worker`; they end with the test."""
    children: list[subprocess.Popen[bytes]] = []

    def start(database: str, seconds: float = 0.15) -> "subprocess.Popen[bytes]":
        with (tmp_path / "workers.log").open("ab") as messages:
            children.append(
                subprocess.Popen(
                    [sys.executable, "-m", "tests.serving.work.stub_worker", database, str(tmp_path / "store"),
                     str(tmp_path / "rendered"), str(seconds)],
                    stdin=subprocess.PIPE, stdout=messages, stderr=messages, cwd=ROOT,
                )
            )  # fmt: skip
        return children[-1]

    yield start
    for child in children:
        child.kill()
        child.wait()
        if child.stdin is not None:
            child.stdin.close()


@pytest.fixture
def segments() -> Callable[..., dict[str, Segment]]:
    """Segments with given words."""
    models = Models()
    hashes = input_hashes(models, {}, {})

    def make(*texts: str) -> dict[str, Segment]:
        made = [Segment({"text": text, "fps": 10.0}, {}, models, 15, file_hashes=hashes) for text in texts]
        return {one.address: one for one in made}

    return make


@pytest.fixture
def rendered(tmp_path: Path) -> Callable[[], list[tuple[str, int]]]:
    """Addresses and processes of all renderings so far."""

    def read() -> list[tuple[str, int]]:
        path = tmp_path / "rendered"
        lines = path.read_text().splitlines() if path.exists() else []
        return [(line.split()[0], int(line.split()[1])) for line in lines]

    return read
