"""Jobs of the service as its server sees them: submit, cancel, delete."""

import time
from collections.abc import Callable
from typing import Any

from tts2face.serving.work.blobs import BlobStore
from tts2face.serving.work.changes import Ending, JobChanges
from tts2face.serving.work.engine import ACTIVE, JOBS_PER_QUERY
from tts2face.serving.work.jobs import CANCELLED, JobRecord, NewJob
from tts2face.serving.work.queues import APPLICATION, APPLICATION_VERSION, JOB_WORKFLOW, QUEUE
from tts2face.serving.work.usage import UsageTable
from tts2face.storage.sql import Database, Transaction

CONNECT_S = 2  # to PostgreSQL; then the request is refused
SESSION_OPTIONS = "-c statement_timeout=10000 -c lock_timeout=8000"  # ms
N_CONNECTIONS = 8
FILES_PER_CHANGE = 100  # while all changes of jobs wait


class JobClient:
    """Jobs in a prepared database.

    Parameters
    ----------
    url
        URL of the database.
    blobs
        Files of the jobs.
    """

    def __init__(self, url: str, blobs: BlobStore) -> None:
        from dbos import DBOSClient

        self._database = Database(url, n_connections=N_CONNECTIONS, connect_s=CONNECT_S, options=SESSION_OPTIONS)
        self._client: Any = DBOSClient(
            system_database_url=url, application_name=APPLICATION, retry_connection_errors=False, lazy=True
        )
        self.blobs = blobs
        self.changes = JobChanges(self._database)
        self.table = self.changes.table
        self.usage = UsageTable(self._database)

    def close(self) -> None:
        """Close all connections."""
        self._client.destroy()
        self._database.close()

    def submit(
        self, new: NewJob, max_waiting: int | None = None, put_missing: Callable[[], None] = lambda: None
    ) -> tuple[JobRecord, bool]:
        """Queue a job; arguments, result and errors as `JobTable.submit`.

        Parameters
        ----------
        put_missing
            Called within the transaction: stores files that another job's deletion has removed meanwhile.
        """

        def enqueue(change: Transaction, n_waiting: int) -> None:
            put_missing()
            options = {
                "queue_name": new.queue,
                "workflow_name": JOB_WORKFLOW,
                "workflow_id": new.id,
                "app_version": APPLICATION_VERSION,
                "priority": 1 + n_waiting,  # keys take turns: their first jobs, then their second ones
            }
            self._client.enqueue_in_transaction(change.connection, options, new.id)

        return self.table.submit(new, enqueue, max_waiting)

    def cancel(self, job_id: str) -> bool:
        """Cancel an open job, and the segments that only it uses; false if it has ended before."""
        segments = self.table.own_segments(job_id)
        if not self.changes.end(job_id, Ending(CANCELLED, error="cancelled")):
            return False
        self.changes.forget_inputs(job_id, self.blobs.delete)
        self._client.cancel_workflows([job_id])
        for at in range(0, len(segments), JOBS_PER_QUERY):
            found = [self._active(address) for address in segments[at : at + JOBS_PER_QUERY]]
            names = [name for part in found for name in part]
            if names:
                self._client.cancel_workflows(names)
        return True

    def delete(self, job_id: str) -> None:
        """Delete a job with the files that no other job uses; an open one is cancelled first."""
        self.cancel(job_id)
        self.table.delete(job_id, self.blobs.delete)
        self._client.delete_workflows([job_id])

    def remove_unused_files(self, older_than_s: float) -> int:
        """Remove files that no job has, such as those of requests that were refused; their number.

        Parameters
        ----------
        older_than_s
            Seconds since they were stored.
        """
        before, n_removed = time.time() - older_than_s, 0

        def remove(sha256: str) -> None:
            nonlocal n_removed
            self.blobs.delete(sha256)
            n_removed += 1

        old = [sha256 for sha256, stored_s in self.blobs.entries() if stored_s < before]
        for at in range(0, len(old), FILES_PER_CHANGE):
            self.changes.remove_unused(set(old[at : at + FILES_PER_CHANGE]), remove)
        return n_removed

    def is_reachable(self) -> bool:
        """Whether the database answers; raises `DatabaseAwayError` if not."""
        with self._database.transaction() as read:
            return bool(read.value("SELECT 1"))

    def _active(self, address: str) -> list[str]:
        """Names of the jobs of the queue of a segment that have not ended."""
        found = self._client.list_workflows(
            workflow_id_prefix=f"{address}.",
            queue_name=QUEUE,
            status=sorted(ACTIVE),
            load_input=False,
            load_output=False,
        )
        return [job.workflow_id for job in found]
