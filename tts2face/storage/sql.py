"""A database, SQLite or PostgreSQL: transactions whose failures are `BackendError`, and the creation of tables."""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from lexicon.errors import BackendError

NOW = {"sqlite": "(julianday('now') - 2440587.5) * 86400.0", "postgresql": "EXTRACT(EPOCH FROM clock_timestamp())"}
N_CREATE_TRIES, CREATE_PAUSE_S = 5, 0.2  # of tables that another process may be creating
LOCK_KEY = 5_742_301  # of PostgreSQL's advisory lock for transactions that wait for each other
# SQLite's driver begins a transaction with the first change; this one begins with the lock for writing.
_LOCK = {"sqlite": "BEGIN IMMEDIATE", "postgresql": f"SELECT pg_advisory_xact_lock({LOCK_KEY})"}


class DatabaseAwayError(BackendError):
    """The database cannot be reached now; another try may succeed."""


def database_kind(url: str) -> str:
    """``sqlite`` or ``postgresql``."""
    return "sqlite" if url.startswith("sqlite") else "postgresql"


def connection_errors() -> tuple[type[Exception], ...]:
    """Errors of SQLAlchemy after which another try may succeed."""
    from sqlalchemy import exc

    return exc.OperationalError, exc.InterfaceError, exc.InternalError, exc.TimeoutError


def database_reason(error: Exception, n_characters: int = 200) -> str:
    """The message of the database's own driver, if an error of SQLAlchemy has one, on one line."""
    return " ".join(str(getattr(error, "orig", None) or error).split())[:n_characters]


class Database:
    """Transactions in a database, by its URL."""

    def __init__(self, url: str, *, n_connections: int = 4, connect_s: int = 5, options: str = "") -> None:
        import sqlalchemy

        self._away = connection_errors()
        self.kind = database_kind(url)
        self.now = NOW[self.kind]
        self._sql = sqlalchemy.text
        if self.kind == "sqlite":
            arguments: dict[str, Any] = {"timeout": 30.0}
        else:
            arguments = {"connect_timeout": connect_s} | ({"options": options} if options else {})
            # SQLAlchemy takes psycopg2 without a driver's name, which is not installed
            url = url.replace("postgresql://", "postgresql+psycopg://", 1)
        self._engine = sqlalchemy.create_engine(
            url, pool_pre_ping=True, connect_args=arguments, pool_size=1, max_overflow=n_connections - 1,
            pool_timeout=10,
        )  # fmt: skip
        # Of `connect`, and of its use.
        self.errors: tuple[type[Exception], ...] = (
            self._engine.dialect.loaded_dbapi.Error,
            sqlalchemy.exc.SQLAlchemyError,
        )

    @contextmanager
    def transaction(self, *, is_change: bool = False) -> Iterator["Transaction"]:
        """A transaction; one that changes something waits for the others of all processes."""
        try:
            with self._engine.begin() as connection:
                transaction = Transaction(connection, self._sql)
                if is_change:
                    # first: what it reads must not be older than the change before it
                    transaction.run(_LOCK[self.kind])
                yield transaction
        except self._away as away:
            raise DatabaseAwayError(
                f"the database cannot be reached ({database_reason(away, 160)}); try again"
            ) from away

    def connect(self) -> Any:
        """A connection outside of transactions, for a reader that asks often."""
        return self._engine.connect().execution_options(isolation_level="AUTOCOMMIT")

    def close(self) -> None:
        """Close all connections."""
        self._engine.dispose()


class Transaction:
    """Statements of one transaction."""

    def __init__(self, connection: Any, sql: Any) -> None:
        self.connection, self._sql = connection, sql

    def run(self, statement: str, **values: Any) -> int:
        """Execute a statement; the number of rows that it has changed."""
        return int(self.connection.execute(self._sql(statement), values).rowcount)

    def run_many(self, statement: str, rows: list[dict[str, Any]]) -> None:
        """Execute a statement for each row."""
        if rows:
            self.connection.execute(self._sql(statement), rows)

    def rows(self, statement: str, **values: Any) -> list[Any]:
        """Rows of a query."""
        return list(self.connection.execute(self._sql(statement), values))

    def value(self, statement: str, **values: Any) -> Any:
        """First value of a query; None without a row."""
        return self.connection.execute(self._sql(statement), values).scalar()


def create_tables(database: Database, statements: Sequence[str]) -> None:
    """Create tables where they are missing; several processes may do so at once."""

    def create() -> None:
        with database.transaction() as change:
            for statement in statements:
                change.run(statement)

    repeat_creation(create)


def repeat_creation(create: Callable[[], None]) -> None:
    """Call a function that creates tables again if another process was creating them."""
    import sqlalchemy

    for attempt in range(N_CREATE_TRIES):
        try:
            create()
            return
        except (sqlalchemy.exc.DBAPIError, BackendError):
            # IF NOT EXISTS of two processes at once fails in one of them
            if attempt == N_CREATE_TRIES - 1:
                raise
            time.sleep(CREATE_PAUSE_S)
