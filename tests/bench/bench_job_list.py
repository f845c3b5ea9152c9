"""Milliseconds of a page of the list of jobs, by what is asked for, with many jobs in the database.

``PYTHONPATH=. python tests/bench/bench_job_list.py [--database sqlite|postgres] [--jobs N] [--keep FOLDER_OR_URL]``.
``--keep`` uses a database that an earlier run has filled. The jobs are of 20 keys: most are done, one in a hundred has
failed, one in twenty waits and eight run; each has its workflow and a segment in the tables of DBOS.
"""

import argparse
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from tests.serving.work.conftest import Postgres
from tts2face.serving.work.database import database_url, prepare_database
from tts2face.serving.work.jobs import CANCELLED, DONE, FAILED, OPEN_STATES, RUNNING, WAITING, JobTable
from tts2face.serving.work.queues import JOB_QUEUE, JOB_WORKFLOW, QUEUE, WORKFLOW, WORKFLOWS
from tts2face.storage.sql import Database

N_KEYS = 20
N_RUNNING = 8
N_PAGE = 51  # as the service asks for 50
N_TURNS = 7
N_EACH = 3
REQUEST = '{"text": "%s", "face": "ada", "format": "mp4", "seed": 1}' % ("A sentence of a talk. " * 10)
STATUSES = {DONE: "SUCCESS", FAILED: "SUCCESS", CANCELLED: "CANCELLED", WAITING: "ENQUEUED", RUNNING: "PENDING"}


def state_of(number: int, n_jobs: int) -> str:
    """State of a job by its number; those that are open are the newest but one in twenty."""
    if number >= n_jobs - n_jobs // 20:
        return RUNNING if number < n_jobs - n_jobs // 20 + N_RUNNING else WAITING
    return FAILED if number % 101 == 0 else CANCELLED if number % 211 == 0 else DONE


def fill(database: Database, n_jobs: int) -> None:
    """Jobs with their workflows and segments."""
    jobs: list[dict[str, Any]] = []
    workflows: list[dict[str, Any]] = []
    now = time.time()
    for number in range(n_jobs):
        state, created = state_of(number, n_jobs), now - n_jobs + number
        name = f"{number * 2654435761 % 2**32:08x}{number:024x}"
        jobs.append({
            "id": name, "key": f"key{number % N_KEYS}", "state": state, "request": REQUEST, "hash": name * 2,
            "created": created, "finished": None if state in OPEN_STATES else created + 9.0,
            "started": None if state == WAITING else created + 1.0,
        })  # fmt: skip
        status, at = STATUSES[state], 1000 * int(created)
        workflows.append({"id": name, "status": status, "at": at, "name": JOB_WORKFLOW, "queue": JOB_QUEUE})
        workflows.append({"id": f"{name * 2}.0", "status": status, "at": at, "name": WORKFLOW, "queue": QUEUE})
    with database.transaction() as change:
        change.run_many(
            "INSERT INTO tts2face_jobs (id, key_name, kind, state, request, body_hash, created, started, finished) "
            "VALUES (:id, :key, 'clip', :state, :request, :hash, :created, :started, :finished)", jobs,
        )  # fmt: skip
        change.run_many(
            f"INSERT INTO {WORKFLOWS[database.kind]} (workflow_uuid, status, name, queue_name, created_at, updated_at) "
            "VALUES (:id, :status, :name, :queue, :at, :at)", workflows,
        )  # fmt: skip
    if database.kind == "postgresql":  # what its own cleaner does within minutes
        with database.connect() as connection:
            connection.exec_driver_sql("VACUUM ANALYZE")


def questions(table: JobTable) -> Iterator[tuple[str, Callable[[], Any]]]:
    """Queries by their names."""
    newest = table.page(None, None, None, N_PAGE)
    with table.database.transaction() as read:
        half = "SELECT count(*) / 2 FROM tts2face_jobs"
        middle = read.value(f"SELECT id FROM tts2face_jobs ORDER BY created LIMIT 1 OFFSET ({half})")
    assert len(newest) == N_PAGE
    for key in (None, "key7"):
        of_key = "of a key" if key else "of all"
        for state in (None, DONE, FAILED, CANCELLED, WAITING, RUNNING):
            for before in (None, middle):
                name = f"{state or 'any state'} {of_key}{', from the middle' if before else ''}"
                yield name, lambda key=key, state=state, before=before: table.page(key, state, before, N_PAGE)
    yield "numbers by state", table.counts


def measure(database: Database) -> None:
    """Print the least milliseconds of each question, which other work on the machine disturbs least."""
    table = JobTable(database)
    for name, ask in questions(table):
        times = []
        for _ in range(N_TURNS):
            began = time.perf_counter()
            for _ in range(N_EACH):
                found = ask()
            times.append(1000 * (time.perf_counter() - began) / N_EACH)
        print(f"{name:42s} {min(times):8.2f} ms, {len(found)}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--database", choices=("sqlite", "postgres"), default="sqlite")
    parser.add_argument("--jobs", type=int, default=100_000)
    parser.add_argument("--keep", help="path or URL of a database, filled if it is new")
    chosen = parser.parse_args()
    with ExitStack() as stack:
        if chosen.keep:
            place = chosen.keep
        elif chosen.database == "sqlite":
            place = str(Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="bench-"))) / "jobs.sqlite")
        else:
            server = Postgres("-c shared_buffers=512MB")
            stack.callback(server.remove)
            place = server.database()
        url = database_url(place)
        prepare_database(url)
        database = Database(url)
        stack.callback(database.close)
        with database.transaction() as read:
            is_new = not read.value("SELECT count(*) FROM tts2face_jobs")
        if is_new:
            fill(database, chosen.jobs)
        measure(database)


if __name__ == "__main__":
    main()
