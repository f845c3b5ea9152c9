"""Jobs of the service in the database: records of them, and tables of jobs, files, events and segments."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, get_args

from lexicon.errors import BackendError, InputError
from tts2face.serving.work.kinds import KINDS
from tts2face.serving.work.queues import JOB_WORKFLOW, WORKFLOWS
from tts2face.storage.sql import Database, Transaction, create_tables

State = Literal["waiting", "running", "done", "failed", "cancelled"]  # of jobs, and of the studio's background work
WAITING, RUNNING, DONE, FAILED, CANCELLED = STATES = get_args(State)
OPEN_STATES = (WAITING, RUNNING)
ENDINGS = (DONE, FAILED, CANCELLED)
FACTS = ("id", "key_name", "kind", "state", "request", "body_hash", "created", "started", "finished", "error")
COLUMNS = (*FACTS, "n_done", "n_all", "webhook", "webhook_state", "webhook_tries")
INPUT, OUTPUT = "input", "output"  # roles of files
# The column has the ending, which belongs to the results and is written with them. Of an open job it has one word for
# ever (workers of earlier versions write another): whether it waits or runs is what DBOS says, and a begun job whose
# workflow has ended without it counts as running until `JobRunner.end_abandoned`.
IS_OPEN = "finished IS NULL"  # condition of a query
# Of thousands that wait, those that run are few, and found by indexes: PostgreSQL expects few rows of an expression.
_HAS_BEGUN = "(CASE WHEN started IS NULL THEN 0 ELSE 1 END)"
_RUNNING = f"""SELECT workflow_uuid AS running FROM {{workflows}} WHERE status = 'PENDING' AND name = '{JOB_WORKFLOW}'
    UNION SELECT id FROM tts2face_jobs WHERE {IS_OPEN} AND {_HAS_BEGUN} = 1
    AND (SELECT status FROM {{workflows}} WHERE workflow_uuid = id) NOT IN ('ENQUEUED', 'DELAYED')"""
_TABLES = (
    """CREATE TABLE IF NOT EXISTS tts2face_jobs (
    id VARCHAR(64) PRIMARY KEY, key_name VARCHAR(200) NOT NULL, kind VARCHAR(40) NOT NULL, state VARCHAR(10) NOT NULL,
    request TEXT NOT NULL, idempotency_key VARCHAR(255), body_hash VARCHAR(64) NOT NULL,
    created DOUBLE PRECISION NOT NULL, started DOUBLE PRECISION, finished DOUBLE PRECISION,
    n_done INTEGER NOT NULL DEFAULT 0, n_all INTEGER NOT NULL DEFAULT 0, error TEXT,
    webhook TEXT, webhook_state VARCHAR(10), webhook_due DOUBLE PRECISION, webhook_tries INTEGER NOT NULL DEFAULT 0,
    UNIQUE (key_name, idempotency_key))""",
    """CREATE TABLE IF NOT EXISTS tts2face_job_files (
    job_id VARCHAR(64) NOT NULL, role VARCHAR(6) NOT NULL, name VARCHAR(200) NOT NULL, sha256 VARCHAR(64) NOT NULL,
    media_type VARCHAR(100) NOT NULL, n_bytes BIGINT NOT NULL, PRIMARY KEY (job_id, role, name))""",
    """CREATE TABLE IF NOT EXISTS tts2face_job_events (
    job_id VARCHAR(64) NOT NULL, number INTEGER NOT NULL, time DOUBLE PRECISION NOT NULL, content TEXT NOT NULL,
    PRIMARY KEY (job_id, number))""",
    """CREATE TABLE IF NOT EXISTS tts2face_job_segments (
    job_id VARCHAR(64) NOT NULL, address VARCHAR(64) NOT NULL, PRIMARY KEY (job_id, address))""",
    # The list of jobs is read in its order, whatever is asked for.
    "CREATE INDEX IF NOT EXISTS tts2face_jobs_by_time ON tts2face_jobs (created)",
    "CREATE INDEX IF NOT EXISTS tts2face_jobs_by_key ON tts2face_jobs (key_name, created)",
    "CREATE INDEX IF NOT EXISTS tts2face_jobs_by_state ON tts2face_jobs (state, created)",
    "CREATE INDEX IF NOT EXISTS tts2face_jobs_by_key_state ON tts2face_jobs (key_name, state, created)",
    f"CREATE INDEX IF NOT EXISTS tts2face_jobs_open ON tts2face_jobs (created) WHERE {IS_OPEN}",
    f"CREATE INDEX IF NOT EXISTS tts2face_jobs_open_by_key ON tts2face_jobs (key_name, created) WHERE {IS_OPEN}",
    f"CREATE INDEX IF NOT EXISTS tts2face_jobs_begun ON tts2face_jobs ({_HAS_BEGUN}) WHERE {IS_OPEN}",
    "CREATE INDEX IF NOT EXISTS tts2face_job_files_by_hash ON tts2face_job_files (sha256)",
    "CREATE INDEX IF NOT EXISTS tts2face_job_segments_by_address ON tts2face_job_segments (address)",
)
CHILD_TABLES = ("tts2face_job_files", "tts2face_job_events", "tts2face_job_segments")


@dataclass(frozen=True, slots=True)
class JobFile:
    """A file of a job by the hash of its content; `name` is given by the service, never by a client."""

    name: str
    sha256: str
    media_type: str = "application/octet-stream"
    n_bytes: int = 0


@dataclass(frozen=True, slots=True)
class NewJob:
    """A job that is to be queued.

    Parameters
    ----------
    id
        Name of the job, which is also that of its workflow.
    key_name
        Name of the API key of its owner.
    body_hash
        Hash of all that was sent, for the comparison of requests with the same `idempotency_key`.
    webhook
        URL that learns of its end.
    """

    id: str
    key_name: str
    kind: str
    request: Mapping[str, Any]
    body_hash: str
    inputs: tuple[JobFile, ...] = ()
    idempotency_key: str | None = None
    webhook: str | None = None

    @property
    def queue(self) -> str:
        """Queue of its kind."""
        return KINDS[self.kind].queue


@dataclass(frozen=True, slots=True)
class Progress:
    """Parts of a job that are done, and all of them; 0 while they are not known."""

    done: int
    of: int


@dataclass(frozen=True, slots=True)
class Webhook:
    """The message about the end of a job: its URL, whether it waits, was delivered or failed, and the tries so far."""

    url: str
    state: str
    tries: int


@dataclass(frozen=True, slots=True)
class JobRecord:
    """A job in the database; times are seconds since 1970 by its clock.

    Parameters
    ----------
    state
        Its ending; of an open job what DBOS says of its workflow.
    started
        When a worker first took it; DBOS forgets this when another one takes it over, and when it is cancelled.
    """

    id: str
    key_name: str
    kind: str
    state: str
    request: Mapping[str, Any]
    body_hash: str
    created: float
    started: float | None
    finished: float | None
    error: str | None
    progress: Progress
    webhook: Webhook | None
    inputs: tuple[JobFile, ...] = field(default=())
    outputs: tuple[JobFile, ...] = field(default=())

    @property
    def is_open(self) -> bool:
        """Whether it waits or runs."""
        return self.state in OPEN_STATES


@dataclass(frozen=True, slots=True)
class JobEvent:
    """An event of a job; numbers rise from 1."""

    number: int
    time: float
    content: Mapping[str, Any]


def record_from_row(row: Any) -> JobRecord:
    """The record of a row with `COLUMNS`."""
    *facts, done, of, url, state, tries = row
    values = dict(zip(FACTS, facts, strict=True)) | {"progress": Progress(done, of)}
    webhook = None if url is None else Webhook(url, state, tries)
    return JobRecord(**values | {"request": json.loads(values["request"]), "webhook": webhook})


def event_from_row(row: Any) -> JobEvent:
    """The event of a row with its number, time and content."""
    return JobEvent(row[0], row[1], json.loads(row[2]))


class QueueFullError(BackendError):
    """The owner has as many waiting jobs as allowed."""


class OtherBodyError(InputError):
    """The idempotency key was used with another body."""


class JobTable:
    """Jobs of a database.

    Parameters
    ----------
    database
        Its connections.
    """

    def __init__(self, database: Database) -> None:
        self.database = database
        running = _RUNNING.format(workflows=WORKFLOWS[database.kind])
        self._state = f"CASE WHEN NOT {IS_OPEN} THEN state WHEN id IN ({running}) THEN 'running' ELSE 'waiting' END"
        # Tables and conditions of the jobs of a state; None: of all. CROSS JOIN has SQLite start from those that run.
        self._jobs: dict[str | None, str] = {
            None: "tts2face_jobs WHERE 1 = 1",
            WAITING: f"tts2face_jobs WHERE {IS_OPEN} AND id NOT IN ({running})",
            RUNNING: f"({running}) AS found CROSS JOIN tts2face_jobs WHERE id = running AND {IS_OPEN}",
            **{ending: f"tts2face_jobs WHERE state = '{ending}'" for ending in ENDINGS},
        }

    def create(self) -> None:
        """Create the tables where they are missing; several processes may do so at once."""
        create_tables(self.database, _TABLES)

    def submit(
        self, new: NewJob, enqueue: Callable[[Transaction, int], None], max_waiting: int | None = None
    ) -> tuple[JobRecord, bool]:
        """Store and queue a job in one transaction; the job, and whether it is new.

        A job of the same owner with the same idempotency key and body is returned in its place.

        Parameters
        ----------
        enqueue
            Called within the transaction, with the number of waiting jobs that the owner had before.
        max_waiting
            Largest number of waiting jobs of the owner; None: any.

        Raises
        ------
        OtherBodyError
            The idempotency key was used with another body.
        QueueFullError
            The owner has too many waiting jobs.
        DatabaseAwayError
            The database cannot be reached.
        """
        with self.database.transaction(is_change=True) as change:
            found = self._with_key(change, new)
            if found is not None:
                return found, False
            query = f"SELECT count(*) FROM {self._jobs[WAITING]} AND key_name = :key"
            n_waiting = int(change.value(query, key=new.key_name))
            if max_waiting is not None and n_waiting >= max_waiting:
                raise QueueFullError(
                    f"the key {new.key_name} has {max_waiting} waiting jobs; wait until some have ended"
                )
            change.run(
                "INSERT INTO tts2face_jobs (id, key_name, kind, state, request, idempotency_key, body_hash, created, "
                "webhook, webhook_state) VALUES (:id, :key, :kind, 'waiting', :request, :idempotency, :hash, "
                f"{self.database.now}, :webhook, :webhook_state)",
                id=new.id, key=new.key_name, kind=new.kind, request=json.dumps(new.request, ensure_ascii=False),
                idempotency=new.idempotency_key, hash=new.body_hash, webhook=new.webhook,
                webhook_state="waiting" if new.webhook else None,
            )  # fmt: skip
            insert_files(change, new.id, INPUT, new.inputs)
            self.add_event(change, new.id, {"type": "state", "state": "waiting"})
            enqueue(change, n_waiting)
            made = self._find(change, "id = :id", id=new.id)
            assert made is not None
            return made, True

    def get(self, job_id: str) -> JobRecord | None:
        """A job with its files; None if there is none."""
        with self.database.transaction() as read:
            return self._find(read, "id = :id", id=job_id)

    def page(self, key_name: str | None, state: str | None, before: str | None, limit: int) -> list[JobRecord]:
        """Jobs without their files, the newest first.

        Parameters
        ----------
        key_name
            Owner; None: everybody.
        before
            Job after which the page begins; None: the newest.
        """
        chosen, values = self._jobs[state], dict[str, Any](limit=limit)
        if key_name is not None:
            chosen += " AND key_name = :key"
            values["key"] = key_name
        if before is not None:
            chosen += " AND created <= (SELECT created FROM tts2face_jobs WHERE id = :before)"  # by an index
            chosen += " AND (created, id) < (SELECT created, id FROM tts2face_jobs WHERE id = :before)"
            values["before"] = before
        shown = _shown(self._state if state is None else f"'{state}'")
        query = f"SELECT {shown} FROM {chosen} ORDER BY created DESC, id DESC LIMIT :limit"
        with self.database.transaction() as read:
            return [record_from_row(row) for row in read.rows(query, **values)]

    def events(self, job_id: str, after: int, limit: int = 500) -> tuple[list[JobEvent], bool]:
        """Events of a job with larger numbers, and whether it may have further ones."""
        query = "SELECT number, time, content FROM tts2face_job_events WHERE job_id = :id AND number > :after "
        with self.database.transaction() as read:
            is_open = bool(read.value(f"SELECT 1 FROM tts2face_jobs WHERE id = :id AND {IS_OPEN}", id=job_id))
            rows = read.rows(f"{query} ORDER BY number LIMIT :limit", id=job_id, after=after, limit=limit)
        return [event_from_row(row) for row in rows], is_open or len(rows) == limit

    def file_of(self, sha256: str, key_name: str | None) -> JobFile | None:
        """Result of a hash in a job of an owner, or of anybody; None if there is none."""
        query = (
            "SELECT f.name, f.sha256, f.media_type, f.n_bytes FROM tts2face_job_files f JOIN tts2face_jobs j "
            "ON j.id = f.job_id WHERE f.sha256 = :hash AND f.role = 'output' AND j.state = 'done'"
        )
        query += "" if key_name is None else " AND j.key_name = :key"
        with self.database.transaction() as read:
            found = read.rows(f"{query} LIMIT 1", hash=sha256, **({} if key_name is None else {"key": key_name}))
        return JobFile(*found[0]) if found else None

    def counts(self) -> tuple[dict[str, int], float]:
        """Numbers of jobs by state, and the age of the oldest waiting one in seconds."""
        with self.database.transaction() as read:
            query = "SELECT state, count(*) FROM tts2face_jobs GROUP BY state UNION ALL SELECT 'begun', count(*) FROM"
            found = {state: n_jobs for state, n_jobs in read.rows(f"{query} {self._jobs[RUNNING]}")}
            query = f"SELECT {self.database.now} - created FROM {self._jobs[WAITING]} ORDER BY created LIMIT 1"
            oldest_s = read.value(query)
        n_begun = found.pop("begun")
        n_open = found.pop(WAITING, 0) + found.pop(RUNNING, 0)
        ended = {state: found.get(state, 0) for state in ENDINGS}
        return {WAITING: n_open - n_begun, RUNNING: n_begun} | ended, float(oldest_s or 0.0)

    def open_jobs(self) -> list[str]:
        """Names of all waiting and running jobs."""
        with self.database.transaction() as read:
            return [row[0] for row in read.rows(f"SELECT id FROM tts2face_jobs WHERE {IS_OPEN}")]

    def ended_before(self, age_s: float) -> list[str]:
        """Names of jobs that ended some seconds ago or earlier."""
        query = f"SELECT id FROM tts2face_jobs WHERE finished < {self.database.now} - :age"
        with self.database.transaction() as read:
            return [row[0] for row in read.rows(query, age=age_s)]

    def own_segments(self, job_id: str) -> list[str]:
        """Addresses of the segments of a job that no other waiting or running job uses."""
        query = (
            "SELECT address FROM tts2face_job_segments WHERE job_id = :id AND address NOT IN (SELECT s.address FROM "
            f"tts2face_job_segments s JOIN tts2face_jobs j ON j.id = s.job_id WHERE j.{IS_OPEN} AND j.id <> :id)"
        )
        with self.database.transaction() as read:
            return [row[0] for row in read.rows(query, id=job_id)]

    def delete(self, job_id: str, remove: Callable[[str], None]) -> None:
        """Delete a job; `remove` is called with each file that no other job uses.

        All changes of jobs wait meanwhile, so that no job begins to use a file that is being removed.
        """
        with self.database.transaction(is_change=True) as change:
            hashes = {
                row[0] for row in change.rows("SELECT sha256 FROM tts2face_job_files WHERE job_id = :id", id=job_id)
            }
            for table in CHILD_TABLES:
                change.run(f"DELETE FROM {table} WHERE job_id = :id", id=job_id)
            change.run("DELETE FROM tts2face_jobs WHERE id = :id", id=job_id)
            remove_unused(change, hashes, remove)

    def add_event(self, change: Transaction, job_id: str, content: dict[str, Any]) -> None:
        """Add an event to a job; within a transaction that changes jobs."""
        change.run(
            "INSERT INTO tts2face_job_events (job_id, number, time, content) VALUES (CAST(:id AS VARCHAR(64)), (SELECT "
            "coalesce(max(number), 0) + 1 FROM tts2face_job_events WHERE job_id = CAST(:id AS VARCHAR(64))), "
            f"{self.database.now}, :content)", id=job_id, content=json.dumps(content, ensure_ascii=False),
        )  # fmt: skip

    def _with_key(self, change: Transaction, new: NewJob) -> JobRecord | None:
        """The job that has the idempotency key of a new one."""
        if new.idempotency_key is None:
            return None
        condition = "key_name = :key AND idempotency_key = :value"
        found = self._find(change, condition, key=new.key_name, value=new.idempotency_key)
        if found is not None and found.body_hash != new.body_hash:
            raise OtherBodyError("this Idempotency-Key was sent with another body before; use a new one")
        return found

    def _find(self, read: Transaction, condition: str, **values: Any) -> JobRecord | None:
        """The job of a condition, with its files."""
        rows = read.rows(f"SELECT {_shown(self._state)} FROM tts2face_jobs WHERE {condition}", **values)
        return _with_files(read, record_from_row(rows[0])) if rows else None


def _shown(state: str) -> str:
    """`COLUMNS` of a query in which `state` says the state."""
    return ", ".join(f"{state} AS state" if name == "state" else name for name in COLUMNS)


def insert_files(change: Transaction, job_id: str, role: str, files: Sequence[JobFile]) -> None:
    """Insert the files of a role."""
    change.run_many(
        "INSERT INTO tts2face_job_files (job_id, role, name, sha256, media_type, n_bytes) VALUES (:id, :role, :name, "
        ":hash, :type, :bytes)",
        [
            {"id": job_id, "role": role, "name": file.name, "hash": file.sha256, "type": file.media_type,
             "bytes": file.n_bytes}
            for file in files
        ],
    )  # fmt: skip


def remove_unused(read: Transaction, hashes: set[str], remove: Callable[[str], None]) -> None:
    """Call `remove` with the files that no job uses."""
    for sha256 in sorted(hashes):
        if not read.value("SELECT count(*) FROM tts2face_job_files WHERE sha256 = :hash", hash=sha256):
            remove(sha256)


def _with_files(read: Transaction, record: JobRecord) -> JobRecord:
    query = "SELECT role, name, sha256, media_type, n_bytes FROM tts2face_job_files WHERE job_id = :id ORDER BY name"
    files: dict[str, list[JobFile]] = {INPUT: [], OUTPUT: []}
    for role, *rest in read.rows(query, id=record.id):
        files[role].append(JobFile(*rest))
    return replace(record, inputs=tuple(files[INPUT]), outputs=tuple(files[OUTPUT]))
