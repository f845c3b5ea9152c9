"""Signs of life, the return of work, the looks at the queue, and the engine's function on which it all rests."""

import sqlite3
import threading
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from types import SimpleNamespace

import pytest

from tests.packages import reason

pytest.importorskip("dbos", reason=reason("dbos"))

from cli.main import run
from lexicon.errors import BackendError
from tests.running import eventually
from tests.serving.batch.test_prune import age, fill, manifest
from tests.serving.work.conftest import Postgres, StartWorker
from tests.serving.work.server.test_jobs import collect, queue
from tests.serving.work.stub_worker import Stub
from tts2face.serving.batch.segment import Segment
from tts2face.serving.batch.store import open_store
from tts2face.serving.work.database import database_url, prepare_database
from tts2face.serving.work.engine import (
    JOBS_PER_QUERY,
    POLL_S,
    DatabaseEngine,
    QueueEngine,
    _Awaited,
    enqueue,
    open_client,
)
from tts2face.serving.work.queue_control import cancel_jobs, list_jobs, prune_jobs
from tts2face.serving.work.worker import MAX_POLLS_PER_S, Worker, poll_interval
from tts2face.serving.work.worker import POLL_S as WORKER_POLL_S
from tts2face.serving.work.workers import BEAT_S, DEAD_AFTER_S, Workers
from tts2face.storage.sql import Database

Segments = Callable[..., dict[str, Segment]]


def test_the_engine_still_returns_the_work_of_dead_executors() -> None:
    from dbos import DBOS

    assert callable(getattr(DBOS, "_recover_pending_workflows", None)), (
        "this release of dbos has no DBOS._recover_pending_workflows(executor_ids); "
        "tts2face.serving.work.workers.return_work needs "
        "another way to return the work of dead workers to the queue (decision 083)"
    )


def test_a_silent_worker_is_reported_until_it_is_forgotten(database: str) -> None:
    url = database_url(database)
    prepare_database(url)
    with Workers(url) as workers:
        assert workers.beat("a", "here") == set()
        assert workers.beat("b", "there") == set()
        assert abs(workers.now() - time.time()) < 60.0
        workers.leave("a")
        assert workers.beat("b", "there") == workers.beat("b", "there") == {"a"}
        assert set(workers.alive()) == {"b"}
        workers.forget({"a"})
        assert workers.beat("b", "there") == set()


def test_heartbeats_of_a_clock_that_was_set_back_count_as_of_now(database: str) -> None:
    """A worker that died before would be taken for alive until the clock is there again."""
    url = database_url(database)
    prepare_database(url)
    with Workers(url) as workers:
        workers.beat("a", "here")
        workers._now = f"({workers._now} - 3600.0)"
        assert workers.beat("b", "there") == set()
        assert set(workers.alive()) == {"a", "b"}
        workers._now = f"({workers._now} + {DEAD_AFTER_S + 1.0})"
        assert workers.beat("b", "there") == {"a"}


def test_work_of_an_owner_that_is_not_in_the_table_is_returned(
    database: str, segments: Segments, start_worker: StartWorker, tmp_path: Path
) -> None:
    """As after `jobs prune` an hour after the death of all workers."""
    work = segments("Slow words.")
    first = start_worker(database, 60.0)
    queue(database, work)
    eventually(lambda: [one.state for one in list_jobs(database)] == ["running"])
    first.kill()
    first.wait()
    with Workers(database_url(database)) as workers:
        workers.forget_dead(older_than_s=0.0)
        assert workers.alive(within_s=1e9) == {}
    start_worker(database, 0.1)
    assert collect(database, work, tmp_path) == dict.fromkeys(work, "")


def test_a_dead_worker_of_another_version_is_reported_once(
    segments: Segments, start_worker: StartWorker, tmp_path: Path
) -> None:
    """Its work waits for a worker of its version."""
    path = tmp_path / "jobs.sqlite"
    queue(str(path), segments("Words."))
    with closing(sqlite3.connect(path)) as connection, connection:
        connection.execute(
            "UPDATE workflow_status SET status = 'PENDING', executor_id = 'old', application_version = 'segments-0'"
        )
        connection.execute("INSERT INTO tts2face_workers VALUES ('old', 0, 'there')")
    start_worker(str(path), 0.0)
    log = tmp_path / "workers.log"
    eventually(lambda: "took over from 1 workers" in log.read_text())
    time.sleep(2 * BEAT_S + 0.5)
    assert log.read_text().count("took over") == 1
    assert [one.state for one in list_jobs(str(path))] == ["running"]


def test_looks_at_the_queue_are_bounded() -> None:
    assert poll_interval(1) == poll_interval(4) == WORKER_POLL_S
    assert poll_interval(200) == 200 / MAX_POLLS_PER_S > WORKER_POLL_S


def test_a_worker_without_its_database_says_so_in_one_line(tmp_path: Path, segments: Segments) -> None:
    url = f"sqlite:///{tmp_path / 'jobs.sqlite'}"
    prepare_database(url)
    worker = Worker(url, str(tmp_path / "store"), renderer=Stub(tmp_path / "rendered", 0.0))

    class Away(Workers):
        def beat(self, executor_id: str, place: str) -> set[str]:
            from sqlalchemy.exc import OperationalError

            raise OperationalError("INSERT", {}, Exception("connection refused"))

    with Away(url) as workers, pytest.raises(BackendError, match="the worker cannot start: connection refused; check"):
        worker._launch(workers)


def test_batches_of_the_same_segments_in_another_order_are_queued_at_once(
    postgres: Postgres, segments: Segments
) -> None:
    """Their transactions lock the same rows in other orders."""
    work = segments(*(f"Words {number}." for number in range(JOBS_PER_QUERY + 20)))
    url = database_url(postgres.database())
    prepare_database(url)
    n_queued: list[int] = []

    def enqueue_all(names: list[str]) -> None:
        with open_client(url) as client, closing(Database(url)) as jobs:
            n_queued.append(len(enqueue(client, jobs, {name: work[name] for name in names}, 10)))

    orders = (list(work), list(work)[::-1], sorted(work))
    threads = [threading.Thread(target=enqueue_all, args=(order,)) for order in orders]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert n_queued == [len(work)] * 3
    assert sorted(job.name for job in list_jobs(url)) == sorted(f"{name}.0" for name in work)


def test_a_job_of_a_clock_a_day_ahead_delays_no_later_one(
    database: str, segments: Segments, start_worker: StartWorker, tmp_path: Path
) -> None:
    """Whoever looks at the times of ends finds the one that is a day ahead, and none after it."""
    early = segments("One.")
    start_worker(database, 0.8)  # so that some end after the look that finds the one that is ahead
    assert collect(database, early, tmp_path) == dict.fromkeys(early, "")
    move_by_a_day(database, "completed_at")
    work = segments("Two.", "Three.")
    n_looks: list[None] = []
    watched = QueueEngine(database_url(database), 10, on_wait=lambda: n_looks.append(None))
    found = [one.reason for one in watched.render(work, open_store(tmp_path / "store"))]
    assert found == ["", ""]
    assert len(n_looks) * POLL_S < 30.0  # not by a look at all jobs, which came once in a minute


def test_jobs_that_a_clock_a_day_ahead_queued_keep_their_turn(database: str, segments: Segments) -> None:
    early, late = segments("One.", "Two."), segments("Three.")
    queue(database, early)
    move_by_a_day(database, "created_at")
    queue(database, late)
    with Workers(database_url(database)) as workers:
        assert workers.return_later() == 2
        assert workers.return_later() == 0
        assert [one.text for one in list_jobs(database)][-1] in {"Two.", "Three."}
        assert max(one.created_s for one in list_jobs(database)) < workers.now() + 1.0


def test_all_jobs_of_a_large_batch_are_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    """Those that were queued first at each look, the further ones part after part."""
    monkeypatch.setattr("tts2face.serving.work.engine.JOBS_PER_QUERY", 3)
    ended = {"j9", "j4"}

    class Client:
        def list_workflows(self, *, workflow_ids: list[str], load_input: bool) -> list[SimpleNamespace]:
            assert len(workflow_ids) <= 3
            return [SimpleNamespace(workflow_id=one, status="SUCCESS" if one in ended else "PENDING", error=None)
                    for one in workflow_ids]  # fmt: skip

    awaited = _Awaited(Client(), {f"j{number}": f"a{number}" for number in range(11)})
    assert [[address for address, _ in awaited.ended()] for _ in range(3)] == [["a4"], ["a9"], []]
    ended |= {"j0", "j10"}
    assert sorted(address for _ in range(3) for address, _ in awaited.ended()) == ["a0", "a10"]


def move_by_a_day(database: str, column: str) -> None:
    """Move times of the engine's table into the future, as a clock that was ahead has left them."""
    url = database_url(database)
    jobs = Database(url)
    table = "workflow_status" if jobs.kind == "sqlite" else "dbos.workflow_status"
    with jobs.transaction() as change:
        assert change.run(f"UPDATE {table} SET {column} = {column} + 86400000")
    jobs.close()


def test_a_job_that_is_removed_while_a_batch_waits_ends_the_wait(
    database: str, segments: Segments, tmp_path: Path
) -> None:
    work = segments("One.")
    engine = DatabaseEngine(database, str(tmp_path / "store"), n_workers=0)
    found = engine.render(work, open_store(tmp_path / "store"))
    reasons: list[str] = []
    waiting = threading.Thread(target=lambda: reasons.extend(one.reason for one in found))
    queue(database, work)
    waiting.start()
    time.sleep(1.5)  # the batch waits now
    with open_client(database_url(database)) as client:
        client.delete_workflows([f"{next(iter(work))}.0"])
    waiting.join(20.0)
    assert reasons == ["its job was removed from the database; run again"]


def test_more_jobs_than_one_statement_takes_are_pruned(
    segments: Segments, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    database = str(tmp_path / "jobs.sqlite")
    monkeypatch.setattr("tts2face.serving.work.queue_control.JOBS_PER_QUERY", 3)
    queue(database, segments(*(f"Words {number}." for number in range(8))))
    assert cancel_jobs(database) == 8
    assert prune_jobs(database, older_than_s=60.0) == 0
    assert prune_jobs(database) == 8


def test_an_outage_of_the_database_is_two_lines(
    postgres: Postgres, segments: Segments, start_worker: StartWorker, tmp_path: Path
) -> None:
    database = postgres.database()
    work = segments("One.", "Two.")
    first = start_worker(database, 0.1)
    assert set(collect(database, segments("One."), tmp_path).values()) == {""}
    log = tmp_path / "workers.log"
    postgres.stop()
    eventually(lambda: "cannot be reached" in log.read_text())
    postgres.start()
    assert set(collect(database, work, tmp_path).values()) == {""}
    eventually(lambda: "reached again" in log.read_text())
    first.kill()
    lines = log.read_text().splitlines()
    assert len(lines) == 2, lines
    assert lines[0].startswith("the database cannot be reached (")
    assert lines[1] == "the database can be reached again"


def test_nothing_of_a_pruned_job_remains_in_the_database(
    segments: Segments, start_worker: StartWorker, tmp_path: Path
) -> None:
    path = tmp_path / "jobs.sqlite"
    prepare_database(database_url(path))
    start_worker(str(path), 0.0)
    rows = []
    for number in range(3):
        work = segments(f"Words {number}.", f"These are wrong, {number}.")
        collect(str(path), work, tmp_path)
        assert prune_jobs(str(path)) == 2
        with closing(sqlite3.connect(path)) as connection, connection:
            tables = [row[0] for row in connection.execute("SELECT name FROM sqlite_master WHERE type = 'table'")]
            rows.append({one: connection.execute(f"SELECT count(*) FROM {one}").fetchone()[0] for one in tables})
    assert rows[0] == rows[1] == rows[2]
    assert rows[0]["workflow_status"] == 0


def test_segments_of_unfinished_jobs_are_never_pruned(
    segments: Segments, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    database, store = str(tmp_path / "jobs.sqlite"), open_store(tmp_path / "store")
    work = segments("Words.", "Others.")
    queue(database, work)
    waiting, ended = sorted(work)
    assert cancel_jobs(database, [ended]) == 1
    fill(store, tmp_path, waiting, ended)
    age(store.folder, 8 * 86_400.0)
    out = manifest(tmp_path / "out")
    words = ["jobs", "prune", "--database", database, "--store", str(store.folder), "--outputs", str(out)]
    assert run([*words, "--days", "7", "--dry-run"]) == run([*words, "--days", "7"]) == 0
    assert capsys.readouterr().out.splitlines()[1::2] == ["would remove 0 jobs", "removed 0 jobs"]
    assert list(store.addresses()) == [waiting]
