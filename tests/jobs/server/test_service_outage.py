"""The database is down for 10 s: jobs wait, /readyz says so, streams go on, and afterwards all jobs finish."""

import time
from pathlib import Path

import httpx
import pytest

pytest.importorskip("dbos", reason="needs the extra [batch]")
pytest.importorskip("fastapi", reason="needs the extra [service]")

from tests.jobs.conftest import Postgres
from tests.jobs.watch import StoreWatch
from tests.running import ServeProcess, eventually
from tests.service.job_requests import submit

N_JOBS = 12
OUTAGE_S = 10.0
TIMEOUT_S = 240.0
CLIP = {"voice": "espeak", "format": "oculus", "fps": 5}


def test_jobs_wait_for_the_database_and_streams_go_on(postgres: Postgres, tmp_path: Path) -> None:
    settings = {"DATABASE": postgres.database(), "DATA": str(tmp_path), "STORE": str(tmp_path / "store")}
    running = ServeProcess(environment={f"TTS2FACE_SERVE_{name}": value for name, value in settings.items()})
    running.wait_until_ready()
    with StoreWatch(tmp_path / "store") as watch, httpx.Client(base_url=running.url, timeout=60.0) as api:
        try:
            names = [submit(api, {**CLIP, "text": f"Number {number}."}).json()["id"] for number in range(N_JOBS)]
            eventually(lambda: n_done(api) >= 2, TIMEOUT_S)
            with api.stream("GET", f"/v1/jobs/{names[-1]}/events") as events:
                postgres.stop()
                stopped = time.monotonic()
                eventually(lambda: api.get("/readyz").status_code == 503)
                assert api.get("/readyz").json()["checks"] == {
                    "models": True, "data": True, "temporary": True, "database": False, "workers": True,
                    "accepting": True,
                }  # fmt: skip
                assert api.get("/healthz").status_code == 200
                refused = submit(api, {**CLIP, "text": "Now."})
                assert (refused.status_code, refused.json()["error"]["code"]) == (503, "unavailable")
                assert int(refused.headers["retry-after"]) > 0
                assert "127.0.0.1" not in refused.text
                cancelled = api.post(f"/v1/jobs/{names[-1]}/cancel")
                assert (cancelled.status_code, api.get("/v1/jobs").status_code) == (503, 503)
                n_streams = 0
                while time.monotonic() < stopped + OUTAGE_S:
                    assert len(api.post("/v1/clips", json={**CLIP, "text": "A stream."}).content) > 100
                    n_streams += 1
                assert n_streams > 1
                postgres.start()
                lines = list(events.iter_lines())  # up to the end of the job
            assert '"state": "done"' in "".join(lines)
            eventually(lambda: n_done(api) == N_JOBS, TIMEOUT_S)
            eventually(lambda: api.get("/readyz").status_code == 200)
        finally:
            running.close()
    assert [one["event"] for one in running.events() if one["event"].startswith("jobs ")] == [
        "jobs not available", "jobs available",
    ]  # fmt: skip
    assert not [one for one in running.events() if one["event"] == "defect"]
    assert watch.n_twice == 0
    assert len(watch.stored) == N_JOBS


def n_done(api: httpx.Client) -> int:
    return sum(job["state"] == "done" for job in api.get("/v1/jobs").json()["jobs"])
