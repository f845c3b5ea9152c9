"""Usage of keys, counted by all servers of a database together: buckets that refill, and requests that run now.

Each server adds what it has counted since it last did, and reads what the others have.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

from tts2face.storage.sql import Database, Transaction, create_tables

SHARED = ""  # server of the rows that all servers write
RUNS_S = 6.0  # for which a server that says no more counts as running what it ran; rows of this time are read again
OLD_S = 2 * 86_400.0  # after which a bucket is full
SMALLER, LARGER = (
    {"sqlite": lite, "postgresql": postgres} for lite, postgres in (("MIN", "LEAST"), ("MAX", "GREATEST"))
)
_TABLE = """CREATE TABLE IF NOT EXISTS tts2face_key_usage (
    server VARCHAR(64) NOT NULL, key_name VARCHAR(64) NOT NULL, quantity VARCHAR(20) NOT NULL,
    amount DOUBLE PRECISION NOT NULL, at DOUBLE PRECISION NOT NULL, PRIMARY KEY (server, key_name, quantity))"""
_PUT = """
INSERT INTO tts2face_key_usage (server, key_name, quantity, amount, at) VALUES (:server, :key, :quantity, {new}, {now})
ON CONFLICT (server, key_name, quantity) DO UPDATE SET amount = {amount}, at = {now}"""
Name = tuple[str, str]  # of a key, and of a quantity


@dataclass(frozen=True, slots=True)
class Spent:
    """Amount that a server has taken of a bucket that holds `most` and is refilled within `period_s`."""

    name: Name
    amount: float
    most: float
    period_s: float


@dataclass(frozen=True, slots=True)
class SharedUsage:
    """Counts of all servers.

    Parameters
    ----------
    left
        Of the buckets that have changed: what was left, and how many seconds ago.
    running
        What runs at the other servers that are alive.
    """

    left: dict[Name, tuple[float, float]] = field(default_factory=dict)
    running: dict[Name, int] = field(default_factory=dict)


class UsageTable:
    """Usage of keys in a database."""

    def __init__(self, database: Database) -> None:
        self._database, self._read_until = database, 0.0
        kind, now = database.kind, database.now
        refilled = f"{LARGER[kind]}({now} - tts2face_key_usage.at, 0.0) * :most / :period"
        left = f"{SMALLER[kind]}(:most, tts2face_key_usage.amount + {refilled}) - :amount"
        self._spend = _PUT.format(new=":most - :amount", amount=left, now=now)
        self._run = _PUT.format(new=":amount", amount=":amount", now=now)

    def create(self) -> None:
        """Create the table where it is missing; several processes may do so at once."""
        create_tables(self._database, (_TABLE,))

    def exchange(self, server: str, spent: Sequence[Spent], running: dict[Name, int]) -> SharedUsage:
        """Add what a server has spent since the last time and what it runs now; what all of them have.

        Raises
        ------
        DatabaseAwayError
            The database cannot be reached; nothing was added.
        """
        rows = [{"server": server, "key": key, "quantity": quantity, "amount": n}
                for (key, quantity), n in sorted(running.items())]  # fmt: skip
        with self._database.transaction() as change:
            for bucket in sorted(
                spent, key=lambda bucket: bucket.name
            ):  # in one order, so that no two servers wait in a circle
                key, quantity = bucket.name
                change.run(
                    self._spend, server=SHARED, key=key, quantity=quantity, amount=float(bucket.amount),
                    most=float(bucket.most), period=bucket.period_s,
                )  # fmt: skip
            change.run_many(self._run, rows)
            found, now = self._read(change)
        self._read_until = now
        result = SharedUsage()
        for place, key, quantity, amount, at in found:
            if place == SHARED and at <= now + 0.01:  # one in the future is of a clock that was set back
                result.left[key, quantity] = (float(amount), now - float(at))
            elif place not in {SHARED, server} and abs(now - at) < RUNS_S:
                result.running[key, quantity] = result.running.get((key, quantity), 0) + int(amount)
        return result

    def _read(self, read: Transaction) -> tuple[list[tuple[str, str, str, float, float]], float]:
        """Rows that have changed since the last time, and the time by the clock of the database."""
        now = float(read.value(f"SELECT {self._database.now}"))
        query = "SELECT server, key_name, quantity, amount, at FROM tts2face_key_usage WHERE at > :since"
        return read.rows(query, since=min(self._read_until, now) - RUNS_S), now

    def forget_old(self) -> None:
        """Remove buckets that are full again, and what servers that ended have run."""
        with self._database.transaction() as change:
            change.run(f"DELETE FROM tts2face_key_usage WHERE at < {self._database.now} - :age", age=OLD_S)
