"""The workers of a database: who is alive, what they ask of the queues, and the return of the work of the dead.

DBOS' open-source package has no fail-over of its own: work of an executor that died waits for an executor of the same
id. Here every worker has a new id and sends heartbeats; with each of them it learns which workers have sent none for
some time, and returns their work to the queue. A worker is forgotten only when none of its work is running any more. A
segment that two workers take nevertheless is rendered twice and stored once, as its name is its content address.
"""

from collections.abc import Iterable
from typing import Any

from tts2face.serving.work.queues import APPLICATION_VERSION, JOB_WORKFLOW, PLACES, WORKFLOW, WORKFLOWS
from tts2face.storage.sql import Database, DatabaseAwayError, create_tables, database_reason

BEAT_S = 1.5  # between two heartbeats of a worker
DEAD_AFTER_S = 6.0  # without a heartbeat; with the interval of polling this is below 10 s
_TABLE = """
CREATE TABLE IF NOT EXISTS tts2face_workers (
    executor_id VARCHAR(64) PRIMARY KEY, beat DOUBLE PRECISION NOT NULL, place VARCHAR(200) NOT NULL
)"""
_BEAT = """
INSERT INTO tts2face_workers (executor_id, beat, place) VALUES (:id, {now}, :place)
ON CONFLICT (executor_id) DO UPDATE SET beat = {now}"""
_FROM_LATER = "UPDATE tts2face_workers SET beat = {now} WHERE beat > {now} + 1"  # by a clock that was set back since
_QUEUES = ", ".join(f"'{name}'" for name in PLACES)
_WAITS = f"status = 'ENQUEUED' AND queue_name IN ({_QUEUES})"  # condition of the engine's rows
_OURS = f"application_version = '{APPLICATION_VERSION}'"
AHEAD_S = 60.0  # by which clocks of machines may differ


class Workers:
    """Table of workers with the time of their last heartbeat, by the clock of the database."""

    def __init__(self, url: str) -> None:
        self._database = Database(url)
        self._now = self._database.now
        self._table = WORKFLOWS[self._database.kind]
        self._waiting = f"SELECT 1 FROM {self._table} WHERE {_WAITS} AND {_OURS} LIMIT 1"
        self._polling: Any = None  # connection that stays open

    def __enter__(self) -> "Workers":
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close the connections."""
        if self._polling is not None:
            self._polling.close()
        self._database.close()

    def create(self) -> None:
        """Create the table where it is missing; several processes may do so at once."""
        create_tables(self._database, (_TABLE,))

    def now(self) -> float:
        """Seconds since 1970 by the clock of the database."""
        with self._database.transaction() as read:
            return float(read.value(f"SELECT {self._now}"))

    def beat(self, executor_id: str, place: str) -> set[str]:
        """Note that a worker is alive; the ids of workers without a heartbeat.

        Heartbeats of a clock that has been set back since count as of now: a dead worker has none after it.
        """
        query = f"SELECT executor_id FROM tts2face_workers WHERE beat <= {self._now} - :age"
        with self._database.transaction() as change:
            change.run(_BEAT.format(now=self._now), id=executor_id, place=place[:200])
            change.run(_FROM_LATER.format(now=self._now))
            return {str(row[0]) for row in change.rows(query, age=DEAD_AFTER_S)}

    def return_later(self) -> int:
        """Let jobs that a clock queued which has been set back since wait no longer than the others; their number.

        The engine gives those of one priority in the order of their times; these keep theirs among each other.
        """
        later = f"{_WAITS} AND created_at > 1000.0 * ({self._now} + {AHEAD_S})"
        last = f"SELECT max(created_at) FROM {self._table} WHERE {later}"
        now = f"CAST(1000.0 * {self._now} AS BIGINT)"
        query = f"UPDATE {self._table} SET created_at = created_at - ({last}) + {now} WHERE {later}"
        with self._database.transaction() as change:
            return change.run(query)

    def has_waiting(self) -> bool:
        """Whether a job waits in a queue; for one thread, which asks often: on a connection that stays open."""
        while True:
            was_open = self._polling is not None
            try:
                self._polling = self._polling or self._database.connect()
                return self._polling.connection.driver_connection.execute(self._waiting).fetchone() is not None
            except self._database.errors as away:
                polling, self._polling = self._polling, None
                if polling is not None:
                    polling.invalidate()
                    polling.close()
                if not was_open:  # an old connection may be of before a restart of the database
                    raise DatabaseAwayError(
                        f"the database cannot be reached ({database_reason(away)}); try again"
                    ) from away

    def leave(self, executor_id: str) -> None:
        """Note that a worker ends; the others take its jobs over without waiting."""
        with self._database.transaction() as change:
            change.run("UPDATE tts2face_workers SET beat = 0 WHERE executor_id = :id", id=executor_id)

    def alive(self, within_s: float = DEAD_AFTER_S) -> dict[str, str]:
        """Places of the workers that sent a heartbeat within some seconds, by their ids."""
        query = f"SELECT executor_id, place FROM tts2face_workers WHERE beat > {self._now} - :age"
        with self._database.transaction() as read:
            return {str(row[0]): str(row[1]) for row in read.rows(query, age=within_s)}

    def forget(self, executor_ids: Iterable[str]) -> None:
        """Remove workers."""
        rows = [{"id": executor_id} for executor_id in executor_ids]
        with self._database.transaction() as change:
            change.run_many("DELETE FROM tts2face_workers WHERE executor_id = :id", rows)

    def forget_dead(self, older_than_s: float = 3600.0) -> None:
        """Remove workers without a heartbeat for a long time."""
        query = f"DELETE FROM tts2face_workers WHERE beat < {self._now} - :age"
        with self._database.transaction() as change:
            change.run(query, age=older_than_s)


def return_work(executor_ids: set[str]) -> set[str]:
    """Return the running work of executors to the queue; the executors that have none left.

    The engine has no public function that does so safely: `resume_workflows` has no condition on the owner, so that it
    would take work from a worker that has just taken it over, and it sets the number of tries to zero, so that a
    segment that ends every worker would never fail (decision 083).
    """
    from dbos import DBOS

    names = sorted(executor_ids)
    DBOS._recover_pending_workflows(names)
    return executor_ids - {str(job.executor_id) for job in list_running(names)}


def list_running(executor_ids: list[str] | None = None) -> list[Any]:
    """Running jobs of this version, of some executors or all."""
    from dbos import DBOS

    found: list[Any] = DBOS.list_workflows(
        status="PENDING",
        name=[WORKFLOW, JOB_WORKFLOW],
        app_version=APPLICATION_VERSION,
        executor_id=executor_ids,
        load_input=False,
        load_output=False,
    )
    return found
