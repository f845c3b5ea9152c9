"""Everything is killed at once, batch, workers and database, and started again: nothing is lost or rendered again."""

import subprocess
from pathlib import Path

import pytest

pytest.importorskip("dbos", reason="needs the extra [batch]")

from tests.jobs.conftest import Postgres
from tests.jobs.series import make_series
from tests.jobs.server.test_series import COMMAND, DRAFT, check_outputs, start_worker
from tests.jobs.watch import StoreWatch
from tests.running import eventually
from tts2face.serving.work.client import list_jobs

N_CUES = 12
N_WORKERS = 2
TIMEOUT_S = 240.0


@pytest.mark.parametrize("kind", ["sqlite", "postgres"])
def test_killing_everything_at_once_loses_nothing(kind: str, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    server: Postgres | None = request.getfixturevalue("postgres") if kind == "postgres" else None
    database = str(tmp_path / "jobs.sqlite") if server is None else server.database()
    episodes = make_series(tmp_path, N_CUES)
    store, out, log = tmp_path / "store", tmp_path / "clips", tmp_path / "workers.log"
    files = [str(episode.path) for episode in episodes]
    batch = [*COMMAND, "batch", *files, "--out", str(out), "--database", database, "--store", str(store), *DRAFT]
    batch += ["--jobs", "0", "--quiet"]
    with StoreWatch(store) as watch:
        processes = [subprocess.Popen(batch), *(start_worker(database, store, log) for _ in range(N_WORKERS))]
        try:
            eventually(lambda: len(watch.stored) >= 8, TIMEOUT_S)
        finally:
            for one in processes:
                one.kill()
            if server is not None:
                server.kill()
            for one in processes:
                one.wait()
        watch.look()
        n_stored = len(watch.stored)
        n_clips = sum(len(episode.spoken) for episode in episodes)
        assert n_stored < n_clips - N_WORKERS, "all was done before the kill"
        if server is not None:
            server.start()
        workers = [start_worker(database, store, log) for _ in range(N_WORKERS)]
        try:
            done = subprocess.run(batch, capture_output=True, text=True, check=False, timeout=TIMEOUT_S)
        finally:
            for one in workers:
                one.kill()
                one.wait()
    assert done.returncode == 0, done.stderr
    check_outputs(out, episodes)
    assert watch.n_twice == 0
    assert watch.cut_off() <= N_WORKERS
    assert {job.state for job in list_jobs(database)} == {"done"}
    assert sorted(watch.stored) == sorted(job.name.partition(".")[0] for job in list_jobs(database))
