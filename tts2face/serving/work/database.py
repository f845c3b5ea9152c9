"""The database of jobs: a SQLite file, or PostgreSQL by URL."""

import logging
import sqlite3
from contextlib import closing
from pathlib import Path

from lexicon.errors import BackendError, InputError
from tts2face.serving.work.jobs import JobTable
from tts2face.serving.work.usage import UsageTable
from tts2face.serving.work.workers import Workers
from tts2face.storage.sql import (
    Database,
    DatabaseAwayError,
    database_reason,
)

DEFAULT_DATABASE = "tts2face-jobs.sqlite"
POSTGRES_SCHEMES = ("postgresql://", "postgres://", "postgresql+psycopg://")


def database_url(where: str | Path) -> str:
    """URL of a database: PostgreSQL as given, everything else is the path of a SQLite file.

    Raises
    ------
    InputError
        The URL names another kind of database, or the folder of the file does not exist.
    """
    text = str(where)
    if text.startswith(POSTGRES_SCHEMES):
        # SQLAlchemy refuses the short scheme, which providers still print
        return text.replace("postgres://", "postgresql://", 1).replace("postgresql+psycopg://", "postgresql://", 1)
    path = text.removeprefix("sqlite:///")
    if "://" in path:
        raise InputError(f"there is no database {path.split('://')[0]}; give a SQLite file or postgresql://...")
    if not Path(path).resolve().parent.is_dir():
        raise InputError(f"there is no folder {Path(path).resolve().parent} for the database; create it first")
    return f"sqlite:///{Path(path).resolve()}"


def prepare_database(url: str) -> None:
    """Create the tables of jobs and workers where they are missing; SQLite gets a write-ahead log.

    Raises
    ------
    BackendError
        The package dbos is missing, or the database cannot be reached or written.
    """
    try:
        from dbos import DBOS
    except ImportError as missing:
        raise BackendError("jobs need the package dbos; pip install 'tts2face[batch]'") from missing
    import sqlalchemy

    quiet_dbos()
    try:
        if url.startswith("sqlite"):
            with closing(sqlite3.connect(url.removeprefix("sqlite:///"), timeout=30.0)) as connection:
                # readers then do not wait for writers, and the file keeps the setting
                connection.execute("PRAGMA journal_mode=WAL")
        DBOS.migrate(url)
        with Workers(url) as workers:
            workers.create()
        jobs = Database(url)
        try:
            JobTable(jobs).create()
            UsageTable(jobs).create()
        finally:
            jobs.close()
    except (sqlite3.Error, sqlalchemy.exc.SQLAlchemyError, ModuleNotFoundError) as error:
        reason = database_reason(error)
        raise DatabaseAwayError(f"cannot use the database {shown_url(url)} ({reason}); check it") from error


def quiet_dbos(level: int = logging.ERROR) -> None:
    """Messages of the engine below a level are not written; it never sends any."""
    logging.getLogger("dbos").setLevel(level)


def shown_url(url: str) -> str:
    """A URL without its password."""
    # the last one: a password may contain others
    before, at, after = url.rpartition("@")
    if not at or "://" not in before:
        return url
    scheme, _, user = before.partition("://")
    return f"{scheme}://{user.partition(':')[0]}@{after}"
