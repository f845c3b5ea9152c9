"""Jobs of the service in the database: queued once, ended once, files removed with their last job, webhooks leased."""

import threading
import uuid
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from tests.packages import needs, reason

pytest.importorskip("dbos", reason=reason("dbos"))

import sqlalchemy

from tts2face.serving.batch.store import open_store
from tts2face.serving.work import changes as job_changes
from tts2face.serving.work.blobs import open_blobs
from tts2face.serving.work.changes import Ending, JobChanges
from tts2face.serving.work.client import JobClient
from tts2face.serving.work.database import database_url, prepare_database
from tts2face.serving.work.engine import _enqueue_options, open_client
from tts2face.serving.work.jobs import (
    RUNNING,
    STATES,
    JobFile,
    JobTable,
    NewJob,
    OtherBodyError,
    QueueFullError,
    Webhook,
)
from tts2face.serving.work.queues import WORKFLOWS
from tts2face.serving.work.run import JobRunner, job_blobs
from tts2face.storage.sql import Database, DatabaseAwayError


@pytest.fixture
def client(database: str, tmp_path: Path) -> Iterator[JobClient]:
    url = database_url(database)
    prepare_database(url)
    made = JobClient(url, open_blobs(tmp_path / "store", "results"))
    yield made
    made.close()


@pytest.fixture
def changes(database: str) -> Iterator[JobChanges]:
    connections = Database(database_url(database))
    yield JobChanges(connections)
    connections.close()


def new_job(owner: str = "ann", **fields: Any) -> NewJob:
    return replace(NewJob(uuid.uuid4().hex, owner, "clip", {"text": "Hi."}, "0" * 64), **fields)


def take(client: JobClient, changes: JobChanges, name: str, status: str = "PENDING") -> None:
    """Let a worker take a job: what the engine notes, and then the worker."""
    workflows = WORKFLOWS[client._database.kind]
    with client._database.transaction(is_change=True) as change:
        assert change.run(f"UPDATE {workflows} SET status = :status WHERE workflow_uuid = :id", id=name, status=status)
    changes.begin(name)


def ended(client: JobClient, changes: JobChanges, *contents: bytes, owner: str = "ann") -> str:
    """A job that is done, with results of these contents."""
    record, _ = client.submit(new_job(owner))
    files = tuple(JobFile(f"{number}.bin", client.blobs.put(one)) for number, one in enumerate(contents))
    assert changes.begin(record.id) is not None
    assert changes.end(record.id, Ending("done", files))
    return record.id


def test_a_job_is_queued_with_its_files_and_events(client: JobClient, database: str) -> None:
    given = new_job(inputs=(JobFile("audio.wav", "ab" * 32, "audio/wav", 7),))
    record, is_new = client.submit(given)
    assert is_new
    assert client.table.get(record.id) == record
    assert (record.state, record.kind, record.request, record.inputs) == (
        "waiting",
        "clip",
        {"text": "Hi."},
        given.inputs,
    )
    events, may_follow = client.table.events(record.id, 0)
    assert ([one.number for one in events], may_follow) == ([1], True)
    with open_client(database_url(database)) as queue:
        (found,) = queue.list_workflows(workflow_ids=[record.id])
        assert (found.status, found.name, found.queue_name) == ("ENQUEUED", "run_job", "tts2face-jobs")


def test_requests_with_one_idempotency_key_at_once_are_one_job(client: JobClient) -> None:
    found: list[tuple[str, bool]] = []

    def submit() -> None:
        record, is_new = client.submit(new_job(idempotency_key="order-17"))
        found.append((record.id, is_new))

    threads = [threading.Thread(target=submit) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len({name for name, _ in found}) == 1
    assert [is_new for _, is_new in found].count(True) == 1
    assert len(client.table.page(None, None, None, 10)) == 1
    other, is_new = client.submit(new_job("bob", idempotency_key="order-17"))  # of another key
    assert is_new
    assert other.id != found[0][0]
    with pytest.raises(OtherBodyError, match="was sent with another body before; use a new one"):
        client.submit(new_job(idempotency_key="order-17", body_hash="1" * 64))


def test_waiting_jobs_of_an_owner_are_limited(client: JobClient, changes: JobChanges) -> None:
    first, _ = client.submit(new_job(), 2)
    client.submit(new_job(), 2)
    with pytest.raises(QueueFullError, match="the key ann has 2 waiting jobs"):
        client.submit(new_job(), 2)
    assert client.submit(new_job("bob"), 2)[1]
    take(client, changes, first.id)
    assert client.submit(new_job(), 2)[1]


def test_pages_follow_each_other(client: JobClient, changes: JobChanges) -> None:
    names = [client.submit(new_job())[0].id for _ in range(5)]
    client.submit(new_job("bob"))
    take(client, changes, names[0])
    pages, before = [], None
    while page := client.table.page("ann", None, before, 2):
        pages.append([one.id for one in page])
        before = page[-1].id
    assert [len(page) for page in pages] == [2, 2, 1]
    assert [name for page in pages for name in page] == names[::-1]
    assert [one.id for one in client.table.page("ann", "running", None, 9)] == names[:1]
    assert len(client.table.page(None, None, None, 9)) == 6


@pytest.mark.parametrize("owner", [None, "ann"])
@pytest.mark.parametrize("state", [None, *STATES])
def test_a_page_is_read_by_an_index(tmp_path: Path, state: str | None, owner: str | None) -> None:
    """Neither all jobs nor all that wait are read for it; `tests/bench/bench_job_list.py` measures it."""
    url = database_url(tmp_path / "jobs.sqlite")
    prepare_database(url)
    database = Database(url)
    asked: list[tuple[str, Any]] = []
    sqlalchemy.event.listen(
        database._engine, "before_cursor_execute", lambda *given: asked.append((given[2], given[3]))
    )
    JobTable(database).page(owner, state, "0" * 32, 9)
    (query,) = asked
    with database.connect() as connection:
        plan = [row[-1] for row in connection.exec_driver_sql(f"EXPLAIN QUERY PLAN {query[0]}", query[1])]
    database.close()
    assert [step for step in plan if step.startswith("SCAN tts2face_jobs") and "USING INDEX" not in step] == []
    assert ("USE TEMP B-TREE FOR ORDER BY" in plan) == (state == RUNNING)


def test_a_job_ends_once(client: JobClient, changes: JobChanges) -> None:
    record, _ = client.submit(new_job())
    running = changes.begin(record.id)
    again = changes.begin(record.id)  # by the worker that takes over
    assert running is not None
    assert again is not None
    assert running.started == again.started
    assert changes.report(record.id, {"type": "progress", "done": 1, "of": 2})
    assert changes.end(record.id, Ending("done", (JobFile("clip.mp4", "ab" * 32),)))
    assert not changes.end(record.id, Ending("failed", error="late"))
    assert not changes.report(record.id, {"type": "progress", "done": 2, "of": 2})
    assert not client.cancel(record.id)
    assert changes.begin(record.id) is None
    found = client.table.get(record.id)
    assert found is not None
    assert (found.state, found.error, found.progress.done, len(found.outputs)) == ("done", None, 1, 1)
    events, may_follow = client.table.events(record.id, 1)
    assert [one.content.get("state", "progress") for one in events] == ["running", "progress", "done"]
    assert [one.number for one in events] == [2, 3, 4]
    assert not may_follow


def test_whether_a_job_waits_or_runs_is_what_the_engine_says(client: JobClient, changes: JobChanges) -> None:
    name = client.submit(new_job())[0].id
    found = []
    for status in ("PENDING", "ENQUEUED", "PENDING"):  # taken, returned after the death of the worker, taken again
        take(client, changes, name, status)
        found.append(client.table.get(name))
    assert [one.state for one in found if one is not None] == ["running", "waiting", "running"]
    assert len({one.started for one in found if one is not None}) == 1  # when the first worker took it
    assert [one.content["state"] for one in client.table.events(name, 0)[0]] == ["waiting", "running"]


def test_workers_of_earlier_versions_go_on_beside(client: JobClient, changes: JobChanges) -> None:
    """They note that a job runs; what is shown is what the engine says, and the job ends once."""
    name = client.submit(new_job())[0].id
    with client._database.transaction(is_change=True) as change:
        old = "UPDATE tts2face_jobs SET state = 'running', started = 1.0 WHERE id = :id AND state = 'waiting'"
        assert change.run(old, id=name) == 1
    found = client.table.get(name)
    assert found is not None
    assert (found.state, found.is_open, client.table.open_jobs()) == ("waiting", True, [name])
    take(client, changes, name)
    assert [one.id for one in client.table.page("ann", "running", None, 9)] == [name]
    assert changes.end(name, Ending("done"))
    assert not changes.end(name, Ending("failed", error="late"))


def test_cancelling_ends_the_segments_that_only_this_job_uses(
    client: JobClient, changes: JobChanges, database: str
) -> None:
    first, second = client.submit(new_job())[0].id, client.submit(new_job())[0].id
    own, shared = "aa" * 32, "bb" * 32
    with open_client(database_url(database)) as queue:
        for address in (own, shared):
            queue.enqueue(_enqueue_options(f"{address}.0", 1), address, {})
        changes.note_segments(first, [own, shared])
        changes.note_segments(second, [shared])
        assert client.table.own_segments(first) == [own]
        assert client.cancel(first)
        states = {one.workflow_id: one.status for one in queue.list_workflows()}
    assert states == {first: "CANCELLED", second: "ENQUEUED", f"{own}.0": "CANCELLED", f"{shared}.0": "ENQUEUED"}
    found = client.table.get(first)
    assert found is not None
    assert found.state == "cancelled"
    assert changes.begin(first) is None


def test_a_file_is_removed_with_the_last_job_that_has_it(client: JobClient, changes: JobChanges) -> None:
    first = ended(client, changes, b"own", b"shared")
    second = ended(client, changes, b"shared", owner="bob")
    own, shared = (client.blobs.put(one) for one in (b"own", b"shared"))
    assert client.table.file_of(own, "ann") is not None
    assert client.table.file_of(own, "bob") is None
    assert client.table.file_of(own, None) is not None
    client.delete(first)
    assert client.table.get(first) is None
    assert (client.blobs.has(own), client.blobs.has(shared)) == (False, True)
    assert client.table.file_of(shared, "ann") is None
    client.delete(second)
    assert not client.blobs.has(shared)


def test_files_without_a_job_are_removed(client: JobClient, changes: JobChanges) -> None:
    ended(client, changes, b"used")
    client.blobs.put(b"of a refused request")
    assert client.remove_unused_files(3600.0) == 0
    assert client.remove_unused_files(-10.0) == 1
    assert [client.blobs.has(client.blobs.put(one)) for one in (b"used",)] == [True]
    assert len(list(client.blobs.entries())) == 1


def test_keys_take_turns(client: JobClient, database: str) -> None:
    names = [client.submit(new_job(owner))[0].id for owner in ("ann", "ann", "ann", "bob", "bob")]
    with open_client(database_url(database)) as queue:
        found = {one.workflow_id: one.priority for one in queue.list_workflows(name="run_job")}
    assert [found[name] for name in names] == [1, 2, 3, 1, 2]


def test_old_jobs_are_found_by_their_age(client: JobClient, changes: JobChanges) -> None:
    name = ended(client, changes)
    client.submit(new_job())
    assert client.table.ended_before(3600.0) == []
    assert client.table.ended_before(-1.0) == [name]


def test_jobs_are_counted_by_state(client: JobClient, changes: JobChanges) -> None:
    ended(client, changes)
    client.submit(new_job())
    take(client, changes, client.submit(new_job())[0].id)
    counts, age_s = client.table.counts()
    assert counts == {"waiting": 1, "running": 1, "done": 1, "failed": 0, "cancelled": 0}
    assert 0.0 <= age_s < 60.0


def test_a_webhook_is_taken_by_one_server_and_sent_again_until_it_arrives(
    client: JobClient, changes: JobChanges, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(job_changes, "FIRST_PAUSE_S", -1.0)  # due at once
    monkeypatch.setattr(job_changes, "MAX_TRIES", 3)
    record, _ = client.submit(new_job(webhook="https://example.org/done"))
    assert client.changes.due_webhooks() == []
    changes.end(record.id, Ending("failed", error="why"))
    for number in range(3):
        (delivery,) = due = client.changes.due_webhooks()
        assert (delivery.job_id, delivery.key_name, delivery.n_tries) == (record.id, "ann", number)
        assert client.changes.due_webhooks(busy=["bob", "ann"]) == []
        assert client.changes.take_webhooks(due) == due
        assert client.changes.take_webhooks(due) == client.changes.due_webhooks() == []  # leased
        client.changes.note_delivery(delivery, is_delivered=False)
    found = client.table.get(record.id)
    assert found is not None
    assert found.webhook == Webhook("https://example.org/done", "failed", 3)
    assert client.changes.due_webhooks() == []


def test_a_webhook_that_a_clock_a_day_ahead_put_off_is_due(client: JobClient, changes: JobChanges) -> None:
    record, _ = client.submit(new_job(webhook="https://example.org/done"))
    changes.end(record.id, Ending("failed", error="why"))
    client.changes.note_delivery(client.changes.due_webhooks()[0], is_delivered=False)
    assert client.changes.due_webhooks() == []  # in a moment
    with client._database.transaction(is_change=True) as change:
        assert change.run("UPDATE tts2face_jobs SET webhook_due = webhook_due + 86400.0")
    assert [one.job_id for one in client.changes.due_webhooks()] == [record.id]


def test_a_job_whose_workflow_has_ended_without_it_fails_with_the_reason(
    client: JobClient, database: str, tmp_path: Path
) -> None:
    waiting, cancelled, removed = (client.submit(new_job())[0].id for _ in range(3))
    url, store = database_url(database), str(tmp_path / "store")
    with open_client(url) as queue:
        queue.cancel_workflows([cancelled])
        queue.delete_workflows([removed])
    JobRunner(url, open_store(store), job_blobs(store)).end_abandoned()
    found = {name: client.table.get(name) for name in (waiting, cancelled, removed)}
    states = {name: (one.state, one.error) for name, one in found.items() if one is not None}
    assert states[waiting] == ("waiting", None)
    assert states[cancelled] == ("failed", "cancelled")
    assert states[removed] == ("failed", "it was removed from the queue; send it again")


def test_a_database_that_is_away_is_named_as_such(tmp_path: Path) -> None:
    needs("psycopg")
    client = JobClient("postgresql://x@127.0.0.1:1/y", open_blobs(tmp_path, "results"))
    with pytest.raises(DatabaseAwayError, match=r"the database cannot be reached \("):
        client.submit(new_job())
    client.close()
