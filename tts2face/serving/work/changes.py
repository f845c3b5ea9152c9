"""Changes of a job after it was queued: taken, progress, its end, which happens once, and the message about it."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from tts2face.serving.work.jobs import INPUT, IS_OPEN, OUTPUT, JobFile, JobRecord, JobTable, insert_files, remove_unused
from tts2face.storage.sql import Database

LEASE_S = 60.0  # within which a server delivers a webhook that it has taken
# of webhooks: the last try comes 8 hours after the first
FIRST_PAUSE_S = 2.0
PAUSE_FACTOR = 3.0
MAX_TRIES = 10


@dataclass(frozen=True, slots=True)
class Ending:
    """How a job has ended: its state, its results, or the reason."""

    state: str
    outputs: tuple[JobFile, ...] = ()
    error: str | None = None


@dataclass(frozen=True, slots=True)
class WebhookDelivery:
    """A webhook that is to be sent now."""

    job_id: str
    key_name: str
    url: str
    n_tries: int
    due: float


class JobChanges:
    """Changes of the jobs of a database."""

    def __init__(self, database: Database) -> None:
        self._database = database
        self.table = JobTable(database)

    def begin(self, job_id: str) -> JobRecord | None:
        """The job that a worker has taken, noted if it is the first one; None if it has ended or was deleted."""
        with self._database.transaction(is_change=True) as change:
            n_first = change.run(
                f"UPDATE tts2face_jobs SET started = {self._database.now} "
                f"WHERE id = :id AND {IS_OPEN} AND started IS NULL", id=job_id,
            )  # fmt: skip
            if n_first:
                self.table.add_event(change, job_id, {"type": "state", "state": "running"})
        found = self.table.get(job_id)
        return found if found is not None and found.is_open else None

    def is_open(self, job_id: str) -> bool:
        """Whether a job waits or runs."""
        with self._database.transaction() as read:
            return bool(read.value(f"SELECT 1 FROM tts2face_jobs WHERE id = :id AND {IS_OPEN}", id=job_id))

    def note_segments(self, job_id: str, addresses: Iterable[str]) -> None:
        """Note which segments a job needs."""
        with self._database.transaction(is_change=True) as change:
            change.run("DELETE FROM tts2face_job_segments WHERE job_id = :id", id=job_id)
            change.run_many(
                "INSERT INTO tts2face_job_segments (job_id, address) VALUES (:id, :address)",
                [{"id": job_id, "address": address} for address in sorted(set(addresses))],
            )

    def report(self, job_id: str, content: dict[str, Any]) -> bool:
        """Add an event to an open job; false if it is not open. Numbers ``done`` and ``of`` become its progress."""
        with self._database.transaction(is_change=True) as change:
            n_open = change.run(
                f"UPDATE tts2face_jobs SET n_done = coalesce(:done, n_done), n_all = coalesce(:of, n_all) "
                f"WHERE id = :id AND {IS_OPEN}", id=job_id, done=content.get("done"), of=content.get("of"),
            )  # fmt: skip
            if n_open:
                self.table.add_event(change, job_id, content)
        return bool(n_open)

    def pause(self, job_id: str, reason: str | None) -> None:
        """Note why an open job waits, as its error and an event; None: it goes on."""
        event: dict[str, Any] = {"type": "continued"} if reason is None else {"type": "paused", "reason": reason}
        with self._database.transaction(is_change=True) as change:
            query = f"UPDATE tts2face_jobs SET error = :reason WHERE id = :id AND {IS_OPEN}"
            if change.run(query, id=job_id, reason=reason):
                self.table.add_event(change, job_id, event)

    def end(
        self,
        job_id: str,
        ending: Ending,
        store: Callable[[Sequence[JobFile]], None] = lambda _: None,
        also: Callable[[Any], None] = lambda _: None,
    ) -> bool:
        """End an open job; false if it has ended already, by another worker or its owner.

        Parameters
        ----------
        store
            Called with the results within the transaction: it stores those that have been removed meanwhile.
        also
            Called with the transaction.
        """
        with self._database.transaction(is_change=True) as change:
            n_ended = change.run(
                f"UPDATE tts2face_jobs SET state = :state, error = :error, finished = {self._database.now}, "
                "webhook_due = CASE WHEN webhook IS NULL THEN NULL ELSE 0 END "
                f"WHERE id = :id AND {IS_OPEN}", id=job_id, state=ending.state, error=ending.error,
            )  # fmt: skip
            if not n_ended:
                return False
            insert_files(change, job_id, OUTPUT, ending.outputs)
            change.run("DELETE FROM tts2face_job_segments WHERE job_id = :id", id=job_id)
            event: dict[str, Any] = {"type": "state", "state": ending.state}
            if ending.error is not None:
                event["error"] = ending.error
            self.table.add_event(change, job_id, event)
            store(ending.outputs)
            also(change)
        return True

    def forget_inputs(self, job_id: str, remove: Callable[[str], None]) -> None:
        """Forget the files of an ended job, which are somebody's recordings; `remove` gets those of no other job."""
        with self._database.transaction(is_change=True) as change:
            query = "SELECT sha256 FROM tts2face_job_files WHERE job_id = :id AND role = :role"
            hashes = {row[0] for row in change.rows(query, id=job_id, role=INPUT)}
            change.run("DELETE FROM tts2face_job_files WHERE job_id = :id AND role = :role", id=job_id, role=INPUT)
            remove_unused(change, hashes, remove)

    def remove_unused(self, hashes: set[str], remove: Callable[[str], None]) -> None:
        """Call `remove` with the files that no job uses, while no job can begin to use them."""
        with self._database.transaction(is_change=True) as change:
            remove_unused(change, hashes, remove)

    def due_webhooks(self, busy: Sequence[str] = (), limit: int = 1000) -> list[WebhookDelivery]:
        """Webhooks that are to be sent now, those due longest first; none of the keys `busy`.

        One that is due later than a lease or the pause after its last try lasts was put off by a clock that has been
        set back since.
        """
        longest = " ".join(f"WHEN {n_tries} THEN {max(LEASE_S, _pause_s(n_tries))}" for n_tries in range(1, MAX_TRIES))
        now = self._database.now
        names = {f"key{number}": name for number, name in enumerate(busy)}
        others = f"key_name NOT IN ({', '.join(f':{name}' for name in names)}) AND " if names else ""
        query = (
            f"SELECT id, key_name, webhook, webhook_tries, webhook_due FROM tts2face_jobs WHERE {others}"
            f"(webhook_due <= {now} OR webhook_due > {now} + CASE webhook_tries {longest} ELSE {LEASE_S} END) "
            "ORDER BY webhook_due LIMIT :limit"
        )
        with self._database.transaction() as read:
            return [WebhookDelivery(*row) for row in read.rows(query, limit=limit, **names)]

    def take_webhooks(self, due: Sequence[WebhookDelivery]) -> list[WebhookDelivery]:
        """Those of some due webhooks that no other server has taken; none gets them for `LEASE_S`."""
        taken = []
        for delivery in due:
            with self._database.transaction(is_change=True) as change:
                if change.run(
                    f"UPDATE tts2face_jobs SET webhook_due = {self._database.now} + :lease "
                    "WHERE id = :id AND webhook_due = :due", id=delivery.job_id, due=delivery.due, lease=LEASE_S,
                ):  # fmt: skip
                    taken.append(delivery)
        return taken

    def note_delivery(self, delivery: WebhookDelivery, *, is_delivered: bool) -> None:
        """Note that a webhook has arrived, or when it is sent again."""
        n_tries = delivery.n_tries + 1
        is_last = is_delivered or n_tries >= MAX_TRIES
        due = "NULL" if is_last else f"{self._database.now} + :pause"
        state = "delivered" if is_delivered else "failed" if is_last else "waiting"
        pause = {} if is_last else {"pause": _pause_s(n_tries)}
        with self._database.transaction(is_change=True) as change:
            change.run(
                f"UPDATE tts2face_jobs SET webhook_due = {due}, webhook_tries = :tries, webhook_state = :state "
                "WHERE id = :id", id=delivery.job_id, tries=n_tries, state=state, **pause,
            )  # fmt: skip


def _pause_s(n_tries: int) -> float:
    """Seconds between a number of tries to send a webhook and the next one."""
    return FIRST_PAUSE_S * PAUSE_FACTOR ** (n_tries - 1)
