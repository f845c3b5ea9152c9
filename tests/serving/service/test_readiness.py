"""What /readyz finds missing, and what a running job says while its disk is full."""

import asyncio
import logging
import shutil
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from starlette.testclient import TestClient

from tests.running import eventually
from tests.serving.service.in_process import TableProcess, service_client
from tts2face.serving.service import job_service, readiness
from tts2face.serving.service.preparation import Preparation, Step
from tts2face.serving.service.settings import ServiceSettings
from tts2face.serving.work.changes import JobChanges
from tts2face.serving.work.database import database_url, prepare_database
from tts2face.serving.work.jobs import NewJob
from tts2face.serving.work.run import CHECK_S, FULL, JobWatch
from tts2face.storage.sql import Database

MB = 1 << 20


@pytest.fixture
def free(monkeypatch: pytest.MonkeyPatch) -> dict[str, int]:
    """Free bytes of all disks."""
    found = {"bytes": 1000 * MB}
    monkeypatch.setattr(shutil, "disk_usage", lambda _: SimpleNamespace(free=found["bytes"]))
    return found


@pytest.fixture
def client(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[TestClient]:
    """Client of a service whose data folder is there and whose database is elsewhere."""
    monkeypatch.setattr(readiness, "CHECK_S", 0.0)
    settings = ServiceSettings(workers=0, data=tmp_path / "data", database=str(tmp_path / "jobs.sqlite"))
    with service_client(settings, TableProcess()) as client:
        yield client


def ready(client: TestClient) -> tuple[int, list[str], list[str]]:
    """Status, names of what is missing, and the reasons."""
    answer = client.get("/readyz")
    content = answer.json()
    return answer.status_code, [name for name, is_well in content["checks"].items() if not is_well], content["missing"]


def test_a_service_with_all_it_needs_is_ready(client: TestClient, free: dict[str, int]) -> None:
    assert ready(client) == (200, [], [])
    assert set(client.get("/readyz").json()["checks"]) == {
        "models", "data", "temporary", "database", "workers", "accepting",
    }  # fmt: skip


def test_a_full_disk_is_named(client: TestClient, free: dict[str, int]) -> None:
    """By /readyz, and by the refusal of a job when its database cannot write."""
    free["bytes"] = 12 * MB
    status, names, reasons = ready(client)
    assert (status, names) == (503, ["data", "temporary"])
    assert reasons[0] == "the disk of the data folder has 12 MB free, and work needs 200; free some space"
    refused = client.app.state.service.jobs._unavailable()  # type: ignore[attr-defined]
    assert refused.message.startswith("the jobs are not available now: the disk of the data folder has 12 MB free")
    free["bytes"] = 300 * MB
    assert ready(client) == (200, [], [])
    refused = client.app.state.service.jobs._unavailable()  # type: ignore[attr-defined]
    assert "their database cannot be reached" in refused.message


def test_a_data_folder_that_is_gone_is_named(client: TestClient, tmp_path: Path) -> None:
    def removed() -> list[str]:
        shutil.rmtree(tmp_path / "data", ignore_errors=True)  # the start of the service may still write to it
        status, names, reasons = ready(client)
        return reasons if (status, names) == (503, ["data"]) else []

    reasons = eventually(removed)
    assert reasons == [
        "the data folder cannot be written (No such file or directory); check its place, its rights and its disk"
    ]
    assert str(tmp_path) not in reasons[0]


def test_what_is_still_prepared_is_named(client: TestClient) -> None:
    pool = client.app.state.service.pool  # type: ignore[attr-defined]
    pool.processes[0].is_ready = False
    pool.preparation = Preparation([Step("kernels of motion", "", {}, is_shared=True), Step("voice", "", {})], 2)
    seen = []

    async def call(*_: object) -> None:
        pool.processes[0].is_ready = len(seen) > 1  # at last another one is ready
        seen.append((*ready(client), client.get("/readyz").json()["preparing"]))

    asyncio.run(pool.preparation.run(call, 0))
    asyncio.run(pool.preparation.run(call, 1))
    assert seen[:2] == [
        (503, ["models"], [f"the service prepares {part} ({done} of 3 steps are done); wait, or see the log"],
         {"parts": [part], "done": done, "of": 3})
        for done, part in enumerate(["kernels of motion", "voice"])
    ]  # fmt: skip
    assert seen[2] == (200, [], [], {"parts": ["voice"], "done": 2, "of": 3})
    assert client.get("/readyz").json()["preparing"] == {"parts": [], "done": 3, "of": 3}


def test_workers_that_have_ended_are_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(readiness, "CHECK_S", 0.0)
    monkeypatch.setattr(job_service, "SUPERVISE_S", 0.02)
    with service_client(ServiceSettings(workers=1, data=tmp_path), TableProcess()) as client:
        eventually(lambda: ready(client)[0] == 200)
        jobs = client.app.state.service.jobs  # type: ignore[attr-defined]
        jobs._stopped.set()
        jobs._supervisor.join()
        assert ready(client) == (200, ["workers"], ["none of 1 job workers is alive; see the log"])  # streams go on


class HangingJobs:
    """Jobs whose database neither answers nor refuses."""

    n_workers = 1

    def __init__(self) -> None:
        self.n_asked = 0

    async def is_reachable(self) -> bool:
        self.n_asked += 1
        await asyncio.Event().wait()
        return True


def test_a_database_that_hangs_neither_stops_streams_nor_delays_a_probe(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Probes of Kubernetes wait for a second; asked again and again, it holds one task and writes one line."""
    monkeypatch.setattr(readiness, "CHECK_S", 0.0)
    monkeypatch.setattr(readiness, "DATABASE_S", 0.01)
    with (
        service_client(ServiceSettings(workers=0, data=tmp_path), TableProcess()) as client,
        caplog.at_level(logging.INFO),
    ):
        state, jobs = client.app.state.service, HangingJobs()  # type: ignore[attr-defined]
        monkeypatch.setattr(state.readiness, "_jobs", jobs)
        for _ in range(3):
            found = client.get("/readyz")
            assert (found.status_code, found.json()["status"]) == (200, "ready")
            assert found.json()["missing"] == ["the database of the jobs does not answer; check it"]
        assert jobs.n_asked == 1
        lines = client.get("/metrics").text.splitlines()
        assert {'tts2face_ready{check="models"} 1.0', 'tts2face_ready{check="database"} 0.0'} <= set(lines)
        assert client.post("/v1/clips", json={"text": "Hi.", "format": "wav"}).status_code == 200
        said = [one.fields["missing"] for one in caplog.records if one.getMessage() == "readiness"]  # type: ignore[attr-defined]
        assert said == [{"database": "the database of the jobs does not answer; check it"}]
        client.portal and client.portal.call(state.readiness._asking.cancel)


def test_probes_do_not_fill_the_log(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """Those that are answered as they should be; one that is refused is written, since it cannot work."""
    with (
        service_client(ServiceSettings(workers=0, data=tmp_path), TableProcess()) as client,
        caplog.at_level(logging.INFO),
    ):
        service = client.app.state.service  # type: ignore[attr-defined]
        for _ in range(5):
            for path in ("/healthz", "/health", "/readyz", "/metrics"):
                assert client.get(path).status_code == 200
        service.is_draining = True
        assert client.get("/readyz").status_code == 503
        service.is_draining = False
        assert [one.fields["path"] for one in caplog.records if one.getMessage() == "request"] == []  # type: ignore[attr-defined]
        client.get("/v1/models")
        client.get("/readyz", headers={"host": "evil.example"})
        assert [one.fields["status"] for one in caplog.records if one.getMessage() == "request"] == [200, 421]  # type: ignore[attr-defined]
        counted = client.get("/metrics").text
    assert 'tts2face_requests_total{path="/healthz",status="200"} 5.0' in counted


def test_a_running_job_says_why_it_waits(tmp_path: Path, free: dict[str, int], monkeypatch: pytest.MonkeyPatch) -> None:
    url = database_url(tmp_path / "jobs.sqlite")
    prepare_database(url)
    database = Database(url)
    try:
        changes = JobChanges(database)
        changes.table.submit(NewJob("one", "a", "clip", {}, "0"), lambda *_: None)
        job = changes.begin("one")
        assert job is not None
        watch = JobWatch(job, changes, tmp_path)
        clock = Clock(monkeypatch)

        def state() -> tuple[str | None, list[Any]]:
            clock.now += 2 * CHECK_S
            watch.check()
            found = changes.table.get("one")
            assert found is not None
            return found.error, [one.content for one in changes.table.events("one", 2)[0]]

        assert state() == (None, [])
        free["bytes"] = 100 * MB
        assert state() == (FULL, [{"type": "paused", "reason": FULL}])
        assert state()[0] == FULL
        other = JobWatch(changes.table.get("one") or job, changes, tmp_path)  # of the worker that takes over
        assert other._is_paused
        free["bytes"] = 300 * MB
        assert state() == (None, [{"type": "paused", "reason": FULL}, {"type": "continued"}])
    finally:
        database.close()


class Clock:
    """Seconds of the watch of a job."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now = 1000.0
        monkeypatch.setattr("tts2face.serving.work.run.time", SimpleNamespace(monotonic=lambda: self.now))
