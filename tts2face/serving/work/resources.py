"""Table of the uploaded talkers, faces, palettes and dictionaries: whose they are, their names and contents."""

import json
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lexicon.values.json_text import parse_json
from tts2face.serving.work.blobs import BlobStore
from tts2face.serving.work.resource_check import CONTENT, DESCRIPTION, PICTURE
from tts2face.storage.sql import Database, Transaction, create_tables

# The second table has one row; its update is the lock under which names, quotas and contents are changed.
_TABLES = (
    """
    CREATE TABLE IF NOT EXISTS tts2face_resources (
        owner TEXT NOT NULL, kind VARCHAR(20) NOT NULL, name VARCHAR(40) NOT NULL, content CHAR(64) NOT NULL,
        picture VARCHAR(64) NOT NULL, n_bytes BIGINT NOT NULL, created DOUBLE PRECISION NOT NULL,
        description TEXT NOT NULL, PRIMARY KEY (owner, kind, name)
    )""",
    "CREATE TABLE IF NOT EXISTS tts2face_resource_lock (id INTEGER PRIMARY KEY, n BIGINT NOT NULL)",
    "INSERT INTO tts2face_resource_lock (id, n) VALUES (1, 0) ON CONFLICT (id) DO NOTHING",
)
_LOCK = "UPDATE tts2face_resource_lock SET n = n + 1 WHERE id = 1"
_COLUMNS = "owner, kind, name, content, picture, n_bytes, created, description"
_INSERT = f"""
INSERT INTO tts2face_resources ({_COLUMNS})
VALUES (:owner, :kind, :name, :content, :picture, :n_bytes, :created, :description)"""
MB = 1_000_000
_CHOSEN = "owner = :owner AND kind = :kind AND name = :name"
_DELETE = f"DELETE FROM tts2face_resources WHERE {_CHOSEN}"


@dataclass(frozen=True, slots=True)
class StoredResource:
    """A row of the table.

    Parameters
    ----------
    owner
        Name of the key that uploaded it.
    content, picture
        SHA-256 of its file and of its picture; no picture for a dictionary.
    n_bytes
        Of both.
    created
        Seconds since 1970.
    description
        What the check says about it, JSON.
    """

    owner: str
    kind: str
    name: str
    content: str
    picture: str
    n_bytes: int
    description: dict[str, Any]
    created: float = 0.0


@dataclass(frozen=True, slots=True)
class Usage:
    """Number of resources and bytes that a key stores."""

    n_resources: int
    n_bytes: int


def over_quota(owner: str, usage: Usage, limits: Usage, n_bytes: int) -> str | None:
    """Sentence about the limit that `n_bytes` more would exceed; None if there is room."""
    if usage.n_resources >= limits.n_resources:
        return f"the key {owner} has {usage.n_resources} resources, its limit; delete one first"
    if usage.n_bytes + n_bytes > limits.n_bytes:
        return (
            f"the key {owner} stores {usage.n_bytes / MB:.1f} MB, and {n_bytes / MB:.1f} MB more are beyond its "
            f"{limits.n_bytes / MB:g} MB; delete something first"
        )
    return None


def resource_from_folder(owner: str, kind: str, name: str, checked: Path, blobs: BlobStore) -> StoredResource:
    """Row of a resource whose files, which `tts2face.serving.work.resource_check` has written, are put into a store."""
    files = [checked / name for name in (CONTENT, PICTURE) if (checked / name).is_file()]
    stored = {file.name: blobs.put(file) for file in files}
    description = parse_json((checked / DESCRIPTION).read_text(encoding="utf-8"), name)
    n_bytes = sum(file.stat().st_size for file in files)
    return StoredResource(owner, kind, name, stored[CONTENT], stored.get(PICTURE, ""), n_bytes, description)


def keep_files(resource: StoredResource, checked: Path, blobs: BlobStore) -> None:
    """Store files of a resource again that were deleted meanwhile with the last resource that had them."""
    for name, content in ((CONTENT, resource.content), (PICTURE, resource.picture)):
        if content and not blobs.has(content):
            blobs.put(checked / name)


class ResourceTable:
    """The table in a database of `tts2face.serving.work.database.database_url`; created at the first use.

    All methods raise `DatabaseAwayError` if the database cannot be reached.
    """

    def __init__(self, url: str) -> None:
        self._database = Database(url)
        self._is_created = False

    def close(self) -> None:
        """Close the connections."""
        self._database.close()

    def find(self, owner: str, kind: str, name: str) -> StoredResource | None:
        """The resource of a name, if the owner has one."""
        with self._transaction() as read:
            return next(iter(_rows(read, _CHOSEN, owner=owner, kind=kind, name=name)), None)

    def select(self, kind: str, owner: str | None) -> tuple[StoredResource, ...]:
        """Resources of a kind, sorted by name; of all owners if none is given."""
        with self._transaction() as read:
            if owner is None:
                return _rows(read, "kind = :kind", kind=kind)
            return _rows(read, "kind = :kind AND owner = :owner", kind=kind, owner=owner)

    def usage(self, owner: str) -> Usage:
        """Number of resources and bytes of an owner."""
        with self._transaction() as read:
            return _usage(read, owner)

    def add(self, resource: StoredResource, *, check: Callable[[Usage], None], keep: Callable[[], None]) -> bool:
        """Add a resource unless its owner has one of this name; False if so.

        Parameters
        ----------
        check
            Called with what the owner stores already; raises if that leaves no room.
        keep
            Makes sure that the contents are stored; nobody deletes contents meanwhile.
        """
        row: dict[str, Any] = {name: getattr(resource, name) for name in _COLUMNS.split(", ")}
        row |= {"description": json.dumps(resource.description, ensure_ascii=False), "created": time.time()}
        with self._transaction() as change:
            change.run(_LOCK)
            if _rows(change, _CHOSEN, owner=resource.owner, kind=resource.kind, name=resource.name):
                return False
            check(_usage(change, resource.owner))
            change.run(_INSERT, **row)
            keep()
            return True

    def remove(self, owner: str, kind: str, name: str, delete: Callable[[str], None]) -> bool:
        """Remove a resource; `delete` is called with each of its contents that no other one has. False if missing."""
        with self._transaction() as change:
            change.run(_LOCK)
            old = _rows(change, _CHOSEN, owner=owner, kind=kind, name=name)
            change.run(_DELETE, owner=owner, kind=kind, name=name)
            for content in _unused(change, {file for each in old for file in (each.content, each.picture) if file}):
                delete(content)
            return bool(old)

    def remove_unused(self, contents: Iterable[str], delete: Callable[[str], None]) -> int:
        """Call `delete` with each of the contents that no resource has, while none can be added; their number."""
        with self._transaction() as change:
            change.run(_LOCK)
            unused = _unused(change, set(contents))
            for content in unused:
                delete(content)
        return len(unused)

    @contextmanager
    def _transaction(self) -> Iterator[Transaction]:
        """A transaction, in which the tables exist."""
        if not self._is_created:
            create_tables(self._database, _TABLES)
            self._is_created = True
        with self._database.transaction() as transaction:
            yield transaction


def _usage(read: Transaction, owner: str) -> Usage:
    query = "SELECT COUNT(*), COALESCE(SUM(n_bytes), 0) FROM tts2face_resources WHERE owner = :owner"
    ((n_resources, n_bytes),) = read.rows(query, owner=owner)
    return Usage(int(n_resources), int(n_bytes))


def _rows(read: Transaction, chosen: str, **values: Any) -> tuple[StoredResource, ...]:
    query = f"SELECT {_COLUMNS} FROM tts2face_resources WHERE {chosen} ORDER BY name, owner"
    rows = [dict(row._mapping) for row in read.rows(query, **values)]
    return tuple(StoredResource(**{**row, "description": json.loads(row["description"])}) for row in rows)


def _unused(read: Transaction, contents: set[str]) -> tuple[str, ...]:
    """Those of some contents that no row has."""
    query = "SELECT COUNT(*) FROM tts2face_resources WHERE content = :content OR picture = :content"
    return tuple(content for content in sorted(contents) if not read.value(query, content=content))
