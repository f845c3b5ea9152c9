"""Jobs of the service as records: what was asked for, its state, its files."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, get_args

State = Literal["waiting", "running", "done", "failed", "cancelled"]  # of jobs, and of the studio's background work
WAITING, RUNNING, DONE, FAILED, CANCELLED = STATES = get_args(State)
OPEN_STATES = (WAITING, RUNNING)
COLUMNS = (
    "id", "key_name", "kind", "state", "request", "body_hash", "created", "started", "finished", "n_done", "n_all",
    "error", "webhook", "webhook_state", "webhook_tries",
)  # fmt: skip


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
    started: float | None = None
    finished: float | None = None
    n_done: int = 0
    n_all: int = 0
    error: str | None = None
    webhook: str | None = None
    webhook_state: str | None = None
    webhook_tries: int = 0
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
    values = dict(zip(COLUMNS, row, strict=True))
    return JobRecord(**{**values, "request": json.loads(values["request"])})


def event_from_row(row: Any) -> JobEvent:
    """The event of a row with its number, time and content."""
    return JobEvent(row[0], row[1], json.loads(row[2]))
