"""Control of the queue of segments: list, show, cancel, retry, prune."""

from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

from lexicon.errors import InputError
from tts2face.serving.batch.segment import segment_from_json
from tts2face.serving.work.database import database_url, prepare_database
from tts2face.serving.work.engine import ACTIVE, JOBS_PER_QUERY, enqueue, failure_reason, open_client
from tts2face.serving.work.jobs import CANCELLED, FAILED, State
from tts2face.serving.work.queues import JOB_WORKFLOW, WORKFLOW
from tts2face.serving.work.workers import Workers
from tts2face.storage.sql import Database

STATES: Mapping[str, State] = {
    "ENQUEUED": "waiting",
    "DELAYED": "waiting",
    "PENDING": "running",
    "SUCCESS": "done",
    "ERROR": "failed",
    "MAX_RECOVERY_ATTEMPTS_EXCEEDED": "failed",
    "CANCELLED": "cancelled",
}
MIN_NAME_CHARACTERS = 6


@dataclass(frozen=True, slots=True)
class QueuedSegment:
    """A segment in the queue.

    Parameters
    ----------
    name
        Content address of the segment, a point, and the number of the try.
    state
        waiting, running, done, failed or cancelled.
    text
        Words of the segment; empty for silence.
    worker
        Place of the worker that runs it or ran it last.
    """

    name: str
    state: str
    priority: int
    text: str
    worker: str
    n_tries: int
    reason: str
    created_s: float
    took_s: float | None


def list_jobs(database: str, states: Sequence[str] = (), limit: int | None = None) -> tuple[QueuedSegment, ...]:
    """Jobs of a database, the oldest first.

    Raises
    ------
    InputError
        There is no such state.
    BackendError
        The database cannot be used.
    """
    for state in states:
        if state not in STATES.values():
            raise InputError(f"there is no state {state!r}; choose {', '.join(dict.fromkeys(STATES.values()))}")
    url = _prepared(database)
    statuses = [status for status, state in STATES.items() if not states or state in states]
    with open_client(url) as client, Workers(url) as workers:
        # the dead as well: a job shows where it was rendered
        places = workers.alive(within_s=1e9)
        found = client.list_workflows(name=WORKFLOW, status=statuses, limit=limit)
        return tuple(_job(job, places) for job in found)


def show_job(database: str, name: str) -> tuple[QueuedSegment, dict[str, Any]]:
    """A job by the start of its name, and its segment as JSON; errors as `list_jobs` and `InputError` without one."""
    url = _prepared(database)
    with open_client(url) as client, Workers(url) as workers:
        job = _find(client, name)
        content = job.input["args"][1] if job.input else {}
        return _job(job, workers.alive(within_s=1e9)), dict(content)


def cancel_jobs(database: str, names: Sequence[str] = ()) -> int:
    """Cancel waiting and running jobs by name, or all of them; their number."""
    with open_client(_prepared(database)) as client:
        chosen = [_find(client, name) for name in names] if names else _of_states(client, ACTIVE, load_input=False)
        active = [job.workflow_id for job in chosen if job.status in ACTIVE]
        for at in range(0, len(active), JOBS_PER_QUERY):
            # in parts: a database limits the parameters of a statement
            client.cancel_workflows(active[at : at + JOBS_PER_QUERY], cancel_children=True)
        return len(active)


def retry_jobs(database: str, names: Sequence[str] = (), priority: int | None = None) -> int:
    """Queue failed and cancelled jobs again by name, or all of them; their number."""
    ended = frozenset(status for status, state in STATES.items() if state in (FAILED, CANCELLED))
    url = _prepared(database)
    with open_client(url) as client, closing(Database(url)) as jobs:
        chosen = [_find(client, name) for name in names] if names else _of_states(client, ended)
        latest = {job.workflow_id.partition(".")[0]: job for job in chosen if job.status in ended}
        for address, job in latest.items():
            segment = segment_from_json(job.input["args"][1])
            enqueue(client, jobs, {address: segment}, job.priority if priority is None else priority)
        return len(latest)


def unfinished_segments(database: str) -> frozenset[str]:
    """Addresses of the segments of waiting and running jobs."""
    with open_client(_prepared(database)) as client:
        found = _of_states(client, ACTIVE, load_input=False)
    return frozenset(job.workflow_id.partition(".")[0] for job in found)


def prune_jobs(database: str, older_than_s: float = 0.0, *, dry_run: bool = False) -> int:
    """Remove jobs that have ended some seconds ago or earlier; their number. Stored segments stay."""
    url = _prepared(database)
    removed = 0
    with open_client(url) as client, Workers(url) as workers:
        before = datetime.fromtimestamp(workers.now() - older_than_s, UTC).isoformat()
        while True:
            ended = client.list_workflows(
                name=[WORKFLOW, JOB_WORKFLOW],
                status=sorted(frozenset(STATES) - ACTIVE),
                completed_before=before,
                limit=JOBS_PER_QUERY,
                # what was removed has left the list
                offset=removed if dry_run else 0,
                load_input=False,
                load_output=False,
            )
            removed += len(ended)
            if not ended:
                break
            if not dry_run:
                client.delete_workflows([job.workflow_id for job in ended])
        if not dry_run:
            workers.forget_dead()
    return removed


def _prepared(database: str) -> str:
    url = database_url(database)
    prepare_database(url)
    return url


def _of_states(client: Any, statuses: frozenset[str], *, load_input: bool = True) -> list[Any]:
    found: list[Any] = client.list_workflows(
        name=WORKFLOW, status=sorted(statuses), load_input=load_input, load_output=False
    )
    return found


def _find(client: Any, name: str) -> Any:
    if len(name) < MIN_NAME_CHARACTERS:
        raise InputError(f"the name {name!r} is too short; give at least {MIN_NAME_CHARACTERS} characters of it")
    found = client.list_workflows(workflow_id_prefix=name, name=WORKFLOW)
    addresses = {job.workflow_id.partition(".")[0] for job in found}
    if len(addresses) != 1:
        raise InputError(f"{len(addresses)} jobs begin with {name!r}; give more of the name that `jobs list` prints")
    # the newest of the jobs of one segment, as they are numbered by `enqueue`
    return max(found, key=lambda job: int(job.workflow_id.partition(".")[2] or 0))


def _job(job: Any, places: dict[str, str]) -> QueuedSegment:
    content = job.input["args"][1] if job.input and len(job.input.get("args", ())) > 1 else {}
    state = STATES.get(job.status, job.status)
    took = None if not job.completed_at or not job.dequeued_at else (job.completed_at - job.dequeued_at) / 1000.0
    return QueuedSegment(
        job.workflow_id,
        state,
        job.priority or 0,
        str(content.get("request", {}).get("text", "")),
        places.get(str(job.executor_id), str(job.executor_id or "")),
        job.recovery_attempts or 0,
        failure_reason(job) if state in (FAILED, CANCELLED) else "",
        (job.created_at or 0) / 1000.0,
        took,
    )
