"""kill -9 of the server and of workers in the middle of many jobs: all finish, none twice.

`TTS2FACE_KILLED_JOBS` is their number (20).
"""

import os
import signal
from collections import Counter
from pathlib import Path
from typing import Any

import httpx
import pytest

from tests.packages import reason

pytest.importorskip("dbos", reason=reason("dbos"))
pytest.importorskip("fastapi", reason=reason("fastapi"))

from tests.running import TABLE_PROGRAM, ServeProcess, eventually
from tests.serving.service.job_requests import wait_for_database
from tests.serving.service.receiver import Receiver
from tests.serving.work.watch import StoreWatch, ends_of_jobs
from tests.started import running_processes
from tts2face.serving.work.database import database_url
from tts2face.serving.work.engine import open_client
from tts2face.serving.work.local_workers import LocalWorker, LocalWorkers
from tts2face.serving.work.queue_control import list_jobs

N_JOBS = int(os.environ.get("TTS2FACE_KILLED_JOBS", "20"))
TIMEOUT_S = 240.0 + 4 * N_JOBS
CLIP = {"voice": "espeak", "format": "oculus", "fps": 5}


class Machines:
    """A service, and another machine's worker, on one database and store."""

    def __init__(self, folder: Path, database: str, receiver: Receiver) -> None:
        self.folder, self.database = folder, database
        self.environment = receiver.environment | {
            "TTS2FACE_SERVE_DATA": str(folder / "data"),
            "TTS2FACE_SERVE_DATABASE": database,
            "TTS2FACE_SERVE_STORE": str(folder / "store"),
        }
        self.start_server()
        self.start_worker()

    def start_server(self) -> None:
        self.server = ServeProcess(environment=self.environment, program=TABLE_PROGRAM)
        wait_for_database(self.server.url)
        self.api = httpx.Client(base_url=self.server.url, timeout=60.0)

    def start_worker(self) -> None:
        self.worker = LocalWorker(LocalWorkers(self.database, str(self.folder / "store")), None)

    def kill_server(self) -> None:
        self.api.close()
        self.server.process.kill()
        self.server.close()

    def kill_worker(self) -> None:
        self.worker.end()  # by SIGKILL

    def kill_worker_of_server(self) -> None:
        """Kill the server's own worker; the server starts another one."""
        parents = running_processes()
        for number in [one for one, parent in parents.items() if parent == self.server.process.pid]:
            if b"tts2face.serving.work.worker" in Path(f"/proc/{number}/cmdline").read_bytes():
                os.kill(number, signal.SIGKILL)

    def jobs(self) -> list[dict[str, Any]]:
        found: list[dict[str, Any]] = self.api.get("/v1/jobs", params={"limit": 100}).json()["jobs"]
        return found

    def wait_for(self, n_done: int) -> None:
        eventually(lambda: self._counts()["done"] >= n_done, TIMEOUT_S)

    def _counts(self) -> Counter[str]:
        found = self.jobs()
        assert [job["error"] for job in found if job["state"] == "failed"] == []
        return Counter(job["state"] for job in found)

    def close(self) -> None:
        self.api.close()
        self.server.close()
        self.kill_worker()


@pytest.mark.parametrize("kind", ["sqlite", "postgres"])
def test_jobs_survive_the_death_of_servers_and_workers(
    kind: str, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    database = str(tmp_path / "jobs.sqlite") if kind == "sqlite" else request.getfixturevalue("postgres").database()
    with Receiver(n_refused=3) as receiver, StoreWatch(tmp_path / "store") as watch:
        machines = Machines(tmp_path, database, receiver)
        try:
            bodies = [
                {
                    "kind": "clip",
                    "request": {**CLIP, "text": f"Number {number}."},
                    "webhook": f"http://{receiver.host}/",
                }
                for number in range(N_JOBS)
            ]
            names = [submit(machines.api, number, body) for number, body in enumerate(bodies)]
            machines.wait_for(N_JOBS // 10)
            machines.kill_worker()
            machines.start_worker()
            machines.wait_for(N_JOBS // 4)
            machines.kill_server()
            machines.kill_worker()  # nobody is left
            machines.start_server()
            assert [submit(machines.api, number, body) for number, body in enumerate(bodies)] == names
            machines.wait_for(N_JOBS // 2)
            machines.kill_worker_of_server()
            machines.start_worker()
            machines.wait_for(N_JOBS)
            check_jobs(machines, names)
            eventually(lambda: {name for name, _ in receiver.messages} == set(names), TIMEOUT_S)
        finally:
            machines.close()
    assert receiver.wrong == []
    assert {content["job"]["id"] for _, content in receiver.messages} == set(names)
    assert watch.n_twice == 0
    assert len(watch.stored) == N_JOBS
    assert {job.state for job in list_jobs(database)} == {"done"}


def submit(api: httpx.Client, number: int, body: dict[str, Any]) -> str:
    answer = api.post("/v1/jobs", json=body, headers={"Idempotency-Key": f"order-{number}"})
    assert answer.status_code in {200, 202}, answer.text
    name: str = answer.json()["id"]
    return name


def check_jobs(machines: Machines, names: list[str]) -> None:
    """Each job is there once, has ended once, and has its result once."""
    found = machines.jobs()
    assert sorted(job["id"] for job in found) == sorted(names)
    assert Counter(job["state"] for job in found) == {"done": N_JOBS}
    once = dict.fromkeys(names, 1)
    assert ends_of_jobs(machines.database) == (once, once)
    with open_client(database_url(machines.database)) as client:
        eventually(lambda: {one.status for one in client.list_workflows(name="run_job")} == {"SUCCESS"})
    for name in names[:: max(1, N_JOBS // 5)]:
        (result,) = machines.api.get(f"/v1/jobs/{name}").json()["results"]
        assert len(machines.api.get(result["url"]).content) == result["bytes"] > 0
