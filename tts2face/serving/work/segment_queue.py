"""The queue of segments in the database: what is queued, under which names, and why a segment is missing."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from tts2face.serving.batch.segment import Segment
from tts2face.serving.work.connection import DatabaseAwayError
from tts2face.serving.work.queues import APPLICATION, APPLICATION_VERSION, QUEUE, WORKFLOW
from tts2face.serving.work.workers import Workers

JOBS_PER_QUERY = 500
ACTIVE = frozenset({"PENDING", "ENQUEUED", "DELAYED"})


@contextmanager
def open_client(url: str) -> Iterator[Any]:
    """Client of a prepared database."""
    import sqlalchemy
    from dbos import DBOSClient

    try:
        client = DBOSClient(system_database_url=url, application_name=APPLICATION)
    except sqlalchemy.exc.SQLAlchemyError as away:
        raise DatabaseAwayError(f"the database cannot be reached ({away}); check its URL") from away
    try:
        yield client
    finally:
        client.destroy()


def enqueue(client: Any, workers: Workers, segments: Mapping[str, Segment], priority: int) -> dict[str, str]:
    """Queue segments; their addresses by the names of their jobs.

    The name of a job is the content address of its segment, so that two batches share it. A job that has ended without
    a stored segment is followed by a new one with the next number.
    """
    import sqlalchemy

    waiting: dict[str, str] = {}
    addresses = list(segments)
    for at in range(0, len(addresses), JOBS_PER_QUERY):
        numbers = dict.fromkeys(addresses[at : at + JOBS_PER_QUERY], 0)
        active = _skip_ended(client, numbers)
        names = {f"{address}.{number}": address for address, number in numbers.items()}
        waiting |= names
        missing = [(name, address) for name, address in names.items() if address not in active]
        jobs = [(_enqueue_options(name, priority), address, segments[address].as_json()) for name, address in missing]
        try:
            with workers.transaction() as connection:
                for job in jobs:
                    client.enqueue_in_transaction(connection, *job)
        except sqlalchemy.exc.DBAPIError:  # such as a deadlock with a batch of the same segments in another order
            for job in jobs:
                client.enqueue(*job)
    return waiting


def _enqueue_options(name: str, priority: int) -> dict[str, Any]:
    return {
        "queue_name": QUEUE,
        "workflow_name": WORKFLOW,
        "workflow_id": name,
        "app_version": APPLICATION_VERSION,
        "priority": priority,
    }


def _skip_ended(client: Any, numbers: dict[str, int]) -> set[str]:
    """Raise the numbers of jobs until none of them has ended; the addresses of those that are active."""
    active: set[str] = set()
    unknown = set(numbers)
    while unknown:
        names = [f"{address}.{numbers[address]}" for address in unknown]
        unknown = set()
        for job in client.list_workflows(workflow_ids=names, load_input=False, load_output=False):
            address = job.workflow_id.partition(".")[0]
            if job.status in ACTIVE:
                active.add(address)
            else:
                numbers[address] += 1
                unknown.add(address)
    return active


def failure_reason(job: Any) -> str:
    """Why a job has ended without a segment."""
    if job.status == "CANCELLED":
        return "cancelled"
    if job.status == "MAX_RECOVERY_ATTEMPTS_EXCEEDED":
        return "every worker that took it died; look at their memory and messages"
    if job.status == "SUCCESS":
        return "the store does not hold it; check that all workers use the same store"
    return " ".join(str(job.error).split()) or "unknown error"
