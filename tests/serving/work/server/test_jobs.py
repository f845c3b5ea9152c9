"""Segments in a database: shared work, deaths, takeover, poison, priorities and control."""

import json
import os
import random
import signal
import sqlite3
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest

from cli.main import run
from lexicon.errors import BackendError, InputError
from tests.packages import needs
from tests.running import eventually
from tests.serving.work.conftest import ROOT, Postgres, StartWorker
from tests.world import World
from tts2face.serving.batch.segment import Segment
from tts2face.serving.batch.store import open_store
from tts2face.serving.work.database import database_url, prepare_database, shown_url
from tts2face.serving.work.engine import DatabaseEngine, enqueue, open_client
from tts2face.serving.work.local_workers import LocalWorker, LocalWorkers
from tts2face.serving.work.queue_control import cancel_jobs, list_jobs, prune_jobs, retry_jobs, show_job
from tts2face.serving.work.queues import APPLICATION_VERSION
from tts2face.serving.work.workers import DEAD_AFTER_S, Workers
from tts2face.storage.sql import Database

Segments = Callable[..., dict[str, Segment]]
Rendered = Callable[[], list[tuple[str, int]]]
OFFLINE = """
import sys
def look(event, arguments):
    if event == "socket.connect" or event == "socket.getaddrinfo":
        print("NETWORK", event, arguments[1:], file=sys.stderr)
sys.addaudithook(look)
from tests.serving.work.stub_worker import Stub
from tts2face.serving.work.worker import Worker
from pathlib import Path
worker = Worker(sys.argv[1], sys.argv[2], renderer=Stub(Path(sys.argv[3]), 0.0))
worker.run(until=lambda: worker.n_rendered == 1)
"""


def queue(database: str, segments: dict[str, Segment], priority: int = 10) -> None:
    url = database_url(database)
    prepare_database(url)
    with open_client(url) as client, closing(Database(url)) as jobs:
        enqueue(client, jobs, segments, priority)


def collect(database: str, segments: dict[str, Segment], tmp_path: Path) -> dict[str, str]:
    """Reasons by address, empty for stored segments, after all have ended."""
    store = open_store(tmp_path / "store")
    engine = DatabaseEngine(database, str(tmp_path / "store"), n_workers=0)
    return {one.address: one.reason for one in engine.render(segments, store)}


def test_two_workers_share_the_queue_and_a_second_batch_costs_nothing(
    database: str, segments: Segments, start_worker: StartWorker, rendered: Rendered, tmp_path: Path
) -> None:
    work = segments(*(f"Words {number}." for number in range(16)))
    workers = [start_worker(database), start_worker(database)]
    assert set(collect(database, work, tmp_path).values()) == {""}
    names = [address for address, _ in rendered()]
    assert sorted(names) == sorted(work)  # each once
    assert {process for _, process in rendered()} == {worker.pid for worker in workers}  # not one alone (#508)
    assert set(collect(database, work, tmp_path).values()) == {""}
    assert len(rendered()) == len(work)


def test_killed_workers_lose_nothing(
    database: str, segments: Segments, start_worker: StartWorker, rendered: Rendered, tmp_path: Path
) -> None:
    work = segments(*(f"Words {number}." for number in range(24)))
    workers = [start_worker(database, 0.3), start_worker(database, 0.3)]
    ended = threading.Event()
    kills = 0

    def kill_now_and_then() -> None:
        nonlocal kills
        generator = random.Random(5)
        for victims in ([0], [0, 1], [1]):  # each after some work, so that a slow machine gets on, too
            n_rendered = len(rendered())
            while len(rendered()) < n_rendered + 2 and not ended.wait(0.1):
                pass
            if ended.wait(generator.uniform(0.0, 1.0)):
                return
            for number in victims:
                workers[number].kill()
                workers[number].wait()
                kills += 1
                workers[number] = start_worker(database, 0.3)

    killer = threading.Thread(target=kill_now_and_then)
    killer.start()
    try:
        reasons = collect(database, work, tmp_path)
    finally:
        ended.set()
        killer.join()
    assert kills >= 2
    assert reasons == dict.fromkeys(work, "")
    assert {address for address, _ in rendered()} == set(work)
    assert len(rendered()) <= len(work) + kills  # twice only what was in flight
    store = open_store(tmp_path / "store")
    assert sorted(store.addresses()) == sorted(work)
    for address in work:
        assert store.fetch(address, tmp_path).read_bytes() == b"movie of " + address.encode()


def test_work_of_a_vanished_worker_is_taken_over_within_ten_seconds(
    database: str, segments: Segments, start_worker: StartWorker, rendered: Rendered, tmp_path: Path
) -> None:
    work = segments("Slow words.")
    first = start_worker(database, 60.0)
    queue(database, work)
    eventually(lambda: [one.state for one in list_jobs(database)] == ["running"])
    start_worker(database, 0.1)
    with Workers(database_url(database)) as workers:
        eventually(lambda: len(workers.alive()) == 2)
    os.kill(first.pid, signal.SIGKILL)
    killed = time.monotonic()
    eventually(lambda: len(rendered()) == 1, 12.0)
    assert time.monotonic() - killed < 10.0
    assert DEAD_AFTER_S < 10.0


def test_a_restarted_database_strands_nothing(
    postgres: Postgres, segments: Segments, start_worker: StartWorker, rendered: Rendered, tmp_path: Path
) -> None:
    """Also in the middle of a recovery (dbos-transact-py #716): recovery is repeated."""
    database = postgres.database()
    work = segments(*(f"Words {number}." for number in range(24)))
    first, _ = start_worker(database, 0.4), start_worker(database, 0.4)
    queue(database, work)
    eventually(lambda: len(rendered()) >= 4)
    first.kill()
    time.sleep(4.0)  # its death is about to be noticed
    postgres.stop()
    time.sleep(1.0)
    postgres.start()
    assert collect(database, work, tmp_path) == dict.fromkeys(work, "")
    assert len(rendered()) <= len(work) + 4


def test_a_double_start_costs_time_and_nothing_else(
    database: str, segments: Segments, start_worker: StartWorker, rendered: Rendered, tmp_path: Path
) -> None:
    """Two jobs of one segment at once, as after a double take of a queue (dbos-transact-py #541)."""
    work = segments("Words.")
    ((address, segment),) = work.items()
    url = database_url(database)
    prepare_database(url)
    with open_client(url) as client:
        for number in (0, 1):
            options = {"queue_name": "tts2face-segments", "workflow_name": "render_segment",
                       "workflow_id": f"{address}.{number}", "app_version": APPLICATION_VERSION,
                       "priority": 1}  # fmt: skip
            client.enqueue(options, address, segment.as_json())
    start_worker(database, 1.0)
    start_worker(database, 1.0)
    eventually(lambda: [one.state for one in list_jobs(database)] == ["done", "done"])
    assert 1 <= len(rendered()) <= 2
    assert list(open_store(tmp_path / "store").addresses()) == [address]


def test_poison_fails_with_its_reason_while_the_rest_goes_on(
    database: str, segments: Segments, start_worker: StartWorker, tmp_path: Path
) -> None:
    work = segments("These are wrong.", *(f"Words {number}." for number in range(4)))
    start_worker(database)
    reasons = collect(database, work, tmp_path)
    assert sorted(reasons.values()) == ["", "", "", "", "these words are wrong"]
    failed = list_jobs(database, ["failed"])
    assert [(one.text, one.reason) for one in failed] == [("These are wrong.", "these words are wrong")]
    assert retry_jobs(database) == 1
    eventually(lambda: len(list_jobs(database, ["failed"])) == 2)  # the second try fails, too


def test_a_segment_that_kills_its_worker_ends_as_failed(
    segments: Segments, start_worker: StartWorker, tmp_path: Path
) -> None:
    database = str(tmp_path / "jobs.sqlite")
    work = segments("This is poison.")
    url = database_url(database)
    queue(database, work)
    name = f"{next(iter(work))}.0"
    with (
        closing(sqlite3.connect(tmp_path / "jobs.sqlite")) as connection,
        connection,
    ):  # as if it had killed many workers before
        connection.execute("UPDATE workflow_status SET recovery_attempts = 12 WHERE workflow_uuid = ?", (name,))
    start_worker(database)
    reasons = collect(database, work, tmp_path)
    assert "every worker that took it died" in reasons[next(iter(work))]
    assert url.startswith("sqlite:///")


def test_smaller_priorities_are_taken_first(
    database: str, segments: Segments, start_worker: StartWorker, rendered: Rendered
) -> None:
    late, early = segments(*(f"Late {number}." for number in range(6))), segments("Early.")
    queue(database, late, priority=20)
    queue(database, early, priority=5)
    start_worker(database, 0.05)
    eventually(lambda: len(rendered()) == 7)
    assert next(iter(early)) in [address for address, *_ in rendered()[:2]]  # a worker holds two jobs at a time


def test_a_segment_of_other_models_is_refused(
    database: str, segments: Segments, start_worker: StartWorker, tmp_path: Path
) -> None:
    (segment,) = segments("Words.").values()
    other = Segment(**{**segment.as_json(), "models": segment.models, "file_hashes": {"talker": "another"}})
    start_worker(database)
    reasons = collect(database, {other.address: other}, tmp_path)
    assert "differs from that of the batch" in reasons[other.address]


def test_jobs_are_listed_shown_cancelled_and_pruned(
    database: str, segments: Segments, start_worker: StartWorker, tmp_path: Path
) -> None:
    work = segments("One.", "Two.", "Three.")
    queue(database, work)
    assert {one.text for one in list_jobs(database, ["waiting"])} == {"One.", "Two.", "Three."}
    first = next(iter(work))
    job, segment = show_job(database, first[:10])
    assert (job.state, segment["request"]["text"]) == ("waiting", "One.")
    assert cancel_jobs(database, [first[:10]]) == 1
    assert [one.text for one in list_jobs(database, ["cancelled"])] == ["One."]
    with pytest.raises(InputError, match="0 jobs begin with"):
        show_job(database, "0123456789ab")
    with pytest.raises(InputError, match="too short"):
        show_job(database, "01")
    with pytest.raises(InputError, match="there is no state 'lost'"):
        list_jobs(database, ["lost"])
    start_worker(database)
    eventually(lambda: len(list_jobs(database, ["done"])) == 2)
    assert prune_jobs(database, older_than_s=3600.0) == 0
    assert prune_jobs(database) == 3
    assert list_jobs(database) == ()
    assert len(list(open_store(tmp_path / "store").addresses())) == 2


def test_the_log_of_sqlite_is_written_ahead(tmp_path: Path) -> None:
    prepare_database(database_url(tmp_path / "jobs.sqlite"))
    with closing(sqlite3.connect(tmp_path / "jobs.sqlite")) as connection, connection:
        assert connection.execute("PRAGMA journal_mode").fetchone() == ("wal",)


@pytest.mark.parametrize(
    ("where", "kind", "reason"),
    [
        ("mysql://x/y", InputError, "there is no database mysql"),
        ("/no/such/folder/jobs.sqlite", InputError, "no folder"),
        ("postgresql://x@127.0.0.1:1/y", BackendError, "cannot use the database postgresql://x@127.0.0.1:1/y"),
    ],
)
def test_databases_that_cannot_be_used_are_named(where: str, kind: type[Exception], reason: str) -> None:
    with pytest.raises(kind, match=reason):
        prepare_database(database_url(where))


def test_passwords_are_not_shown() -> None:
    assert shown_url("postgresql://ann:secret@host/jobs") == "postgresql://ann@host/jobs"


def test_the_commands_list_show_cancel_retry_and_prune(
    segments: Segments, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    database = str(tmp_path / "jobs.sqlite")
    assert run(["jobs", "list", "--database", database]) == 2
    assert "there is no database" in capsys.readouterr().err
    queue(database, segments("Words."))
    name = next(iter(segments("Words.")))[:12]
    for words, expected in (
        (["list"], "1 jobs: 1 waiting"),
        (["list", "--json"], '"state": "waiting"'),
        (["show", name], '"text": "Words."'),
        (["cancel", name], "cancelled 1 jobs"),
        (["retry"], "queued 1 jobs again"),
        (["cancel"], "cancelled 1 jobs"),
        (["prune"], "removed 2 jobs"),
    ):
        assert run(["jobs", *words, "--database", database]) == 0
        printed = capsys.readouterr()
        assert expected in printed.out + printed.err


def test_a_worker_of_a_file_opens_no_connection(segments: Segments, tmp_path: Path) -> None:
    database = str(tmp_path / "jobs.sqlite")
    queue(database, segments("Words."))
    answer = subprocess.run(
        [sys.executable, "-c", OFFLINE, database, str(tmp_path / "store"), str(tmp_path / "rendered")],
        capture_output=True, text=True, check=False, cwd=ROOT, timeout=60,
    )  # fmt: skip
    assert answer.returncode == 0, answer.stderr
    assert "NETWORK" not in answer.stderr
    assert [one.state for one in list_jobs(database)] == ["done"]


@pytest.mark.smoke
def test_the_batch_command_works_with_a_database(
    world: World, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    subtitles = tmp_path / "one.srt"
    subtitles.write_text("1\n00:00:00,000 --> 00:00:01,000\nHello.\n\n2\n00:00:01,000 --> 00:00:02,000\nBob.\n")
    words = ["batch", str(subtitles), "--out", str(tmp_path / "out"), "--size", "64x64", "--fps", "5", "--voice",
             "espeak", "--supersampling", "1", "--database", str(tmp_path / "jobs.sqlite"), *world.models]  # fmt: skip
    assert run([*words, "--quiet"]) == 0, capsys.readouterr().err
    entries = json.loads((tmp_path / "out" / "manifest.json").read_text())["outputs"]
    assert [one["status"] for one in entries] == ["done", "done"]
    assert [one["n_frames"] for one in entries] == [5, 5]


def test_a_worker_that_cannot_start_says_why(tmp_path: Path) -> None:
    needs("psycopg")
    worker = LocalWorker(LocalWorkers("postgresql://nobody@127.0.0.1:1/jobs", str(tmp_path / "store")), None)
    try:
        eventually(lambda: worker.reason, 60.0)
    finally:
        worker.end()
    assert worker.reason.startswith("cannot use the database postgresql://nobody@127.0.0.1:1/jobs")
