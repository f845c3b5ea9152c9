"""Talkers, faces, palettes, dictionaries and tables of marks of the service: shipped ones, and uploads of keys.

All methods block; routes call them in threads.
"""

import re
import time
from dataclasses import asdict
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

from tts2face.request import OWN_FACE
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.keys import ApiKey
from tts2face.serving.service.settings import ServiceSettings
from tts2face.serving.work.blobs import BlobStore, open_blobs
from tts2face.serving.work.database import database_url
from tts2face.serving.work.resource_check import CONTENT, DICTIONARY, FACE, PICTURE, TALKER, TEXT_KINDS, TEXT_MARKS
from tts2face.serving.work.resources import (
    MB,
    ResourceTable,
    StoredResource,
    Usage,
    keep_files,
    over_quota,
    resource_from_folder,
)
from tts2face.serving.work.run import RESOURCES
from tts2face.session import catalogue
from tts2face.storage.files import translate_disk_errors
from tts2face.storage.shipped import find_file

NAME = re.compile(r"[a-z0-9][a-z0-9-]{0,39}")
# Names of models that clients of OpenAI and Kokoro send; all are the service's talker.
CLIENT_MODELS = ("tts-1", "tts-1-hd", "gpt-4o-mini-tts", "kokoro", "tts2face")
MAX_FETCHED = 1000  # contents whose files are remembered
RESERVED = {FACE: (OWN_FACE,), TALKER: CLIENT_MODELS}


def shipped_names(kind: str) -> tuple[str, ...]:
    """Names of the shipped talkers, faces, palettes or dictionaries."""
    return () if kind in TEXT_KINDS else catalogue.shipped_names(kind)


def check_new_name(kind: str, name: str) -> None:
    """Refuse a name for an upload that has the wrong form, or is taken by a shipped model."""
    if NAME.fullmatch(name) is None:
        raise RefusedError(
            422, "invalid_name",
            f"the name {name[:40]!r} is wrong; use 1 to 40 letters a-z, digits and hyphens, with no hyphen first",
        )  # fmt: skip
    if name in (*shipped_names(kind), *RESERVED.get(kind, ())):
        raise RefusedError(409, "name_taken", f"the {kind} {name} belongs to the service; choose another name")


@lru_cache(maxsize=64)
def describe_shipped(kind: str, name: str) -> dict[str, Any]:
    """Description of a shipped talker, face or palette."""
    path = find_file(name, kind)
    if kind == TALKER:
        return asdict(catalogue.describe_talker(path))
    if kind == FACE:
        return asdict(catalogue.describe_face(path))
    return {"styles": [{"name": style.name, "summary": style.summary} for style in catalogue.styles(name)]}


class Library:
    """Resources of a service in its database and its store, both opened at their first use."""

    def __init__(self, settings: ServiceSettings) -> None:
        self._settings = settings
        self._fetched: dict[str, tuple[Path, tuple[int, int] | None]] = {}

    @cached_property
    def _table(self) -> ResourceTable:
        folder = self._settings.data_folder
        with translate_disk_errors(folder):
            folder.mkdir(parents=True, exist_ok=True)
        return ResourceTable(database_url(self._settings.database_place))

    @cached_property
    def _blobs(self) -> BlobStore:
        return open_blobs(self._settings.store_place, RESOURCES, cache=self._settings.data_folder / "resources-cache")

    def close(self) -> None:
        """Close the connections to the database."""
        # not opened by closing it
        if "_table" in self.__dict__:
            self._table.close()

    def resolve(self, key: ApiKey, kind: str, name: str) -> tuple[str, dict[str, Any]]:
        """Value of a field of a request for a name: the name if shipped, the path of an upload; its description.

        Raises
        ------
        RefusedError
            The key has no such resource.
        """
        if name in shipped_names(kind):
            return name, {}
        found = self._table.find(key.name, kind, name) if NAME.fullmatch(name) else None
        if found is None:
            shipped = ", ".join(shipped_names(kind)) or "none"
            raise RefusedError(
                400, "invalid_request",
                f"there is no {kind} {name[:60]!r}; those of the service are {shipped}, and yours are at "
                f"/v1/{plural(kind)}",
            )  # fmt: skip
        return str(self._fetch(found.content)), found.description

    def uploads(self, kind: str, owner: str | None) -> tuple[StoredResource, ...]:
        """Uploads of a kind of one owner, or of all."""
        return self._table.select(kind, owner)

    def upload(self, kind: str, owner: str, name: str) -> StoredResource:
        """An upload.

        Raises
        ------
        RefusedError
            There is none (404).
        """
        found = self._table.find(owner, kind, name) if NAME.fullmatch(name) else None
        if found is None:
            raise RefusedError(404, "not_found", f"there is no {kind} {name[:40]!r}; /v1/{plural(kind)} lists yours")
        return found

    def picture(self, resource: StoredResource) -> Path:
        """Path of an upload's picture.

        Raises
        ------
        RefusedError
            It has none (404).
        """
        if not resource.picture:
            raise RefusedError(404, "not_found", f"a {resource.kind} has no picture")
        return self._fetch(resource.picture)

    def check_room(self, key: ApiKey, kind: str, name: str, n_bytes: int) -> None:
        """Refuse an upload that has no place, before it is read."""
        check_new_name(kind, name)
        if self._table.find(key.name, kind, name) is not None:
            raise self._name_taken(kind, name)
        self._check_quota(key, self._table.usage(key.name), n_bytes)

    def add(self, key: ApiKey, kind: str, name: str, checked: Path) -> StoredResource:
        """Store a resource that was checked into a folder.

        Raises
        ------
        RefusedError
            As `check_room`.
        """
        check_new_name(kind, name)
        size = sum((checked / name).stat().st_size for name in (CONTENT, PICTURE) if (checked / name).is_file())
        self._check_quota(key, self._table.usage(key.name), size)
        made = resource_from_folder(key.name, kind, name, checked, self._blobs)
        is_added = self._table.add(
            made,
            check=lambda usage: self._check_quota(key, usage, made.n_bytes),
            keep=lambda: keep_files(made, checked, self._blobs),
        )
        if not is_added:
            raise self._name_taken(kind, name)
        return self.upload(kind, key.name, name)

    def remove(self, kind: str, owner: str, name: str) -> None:
        """Remove an upload, and its contents unless another upload has the same.

        Raises
        ------
        RefusedError
            There is none (404), or it is shipped (403).
        """
        if name in shipped_names(kind):
            raise RefusedError(403, "forbidden", f"the {kind} {name} belongs to the service and cannot be deleted")
        if NAME.fullmatch(name) is None or not self._table.remove(owner, kind, name, self._blobs.delete):
            raise RefusedError(404, "not_found", f"there is no {kind} {name[:40]!r}; /v1/{plural(kind)} lists yours")

    def remove_unused_files(self, older_than_s: float) -> int:
        """Remove files stored some seconds ago that no resource has, as after a crash in an upload; their number."""
        before = time.time() - older_than_s
        old = [content for content, stored_s in self._blobs.entries() if stored_s < before]
        return self._table.remove_unused(old, self._blobs.delete) if old else 0

    def usage(self, key: ApiKey) -> Usage:
        """Files and bytes that a key stores."""
        return self._table.usage(key.name)

    def limits(self, key: ApiKey) -> Usage:
        """Files and bytes that a key may store."""
        settings = self._settings
        most = settings.resources if key.resources is None else key.resources
        most_mb = settings.resources_mb if key.resources_mb is None else key.resources_mb
        return Usage(most, int(most_mb * MB))

    def _fetch(self, content: str) -> Path:
        """Path of a content, whose hash is computed again only after a change of its file."""
        path, before = self._fetched.get(content, (None, None))
        if path is not None and before == _state_of(path):
            return path
        path = self._blobs.fetch(content)
        if len(self._fetched) >= MAX_FETCHED:
            self._fetched.clear()
        self._fetched[content] = path, _state_of(path)
        return path

    def _check_quota(self, key: ApiKey, usage: Usage, n_bytes: int) -> None:
        reason = over_quota(key.name, usage, self.limits(key), n_bytes)
        if reason is not None:
            raise RefusedError(413, "quota", reason)

    @staticmethod
    def _name_taken(kind: str, name: str) -> RefusedError:
        return RefusedError(409, "name_taken", f"there is a {kind} {name} already; delete it, or choose another name")


def _state_of(path: Path) -> tuple[int, int] | None:
    """Size and time of change of a file; None if there is none."""
    try:
        status = path.stat()
    except OSError:
        return None
    return status.st_size, status.st_mtime_ns


def plural(kind: str) -> str:
    """The word of a kind in addresses."""
    return {DICTIONARY: "dictionaries", TEXT_MARKS: TEXT_MARKS}.get(kind, f"{kind}s")
