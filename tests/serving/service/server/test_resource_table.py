"""The table of resources in both databases, and the library on it: files without rows, refusals, a database away."""

from dataclasses import replace
from pathlib import Path

import pytest

from lexicon.errors import BackendError
from tests.serving.work.conftest import database, postgres  # noqa: F401 - fixtures
from tts2face.serving.service.keys import LOCAL_KEY
from tts2face.serving.service.library import Library
from tts2face.serving.service.settings import ServiceSettings
from tts2face.serving.work.blobs import open_blobs
from tts2face.serving.work.database import database_url
from tts2face.serving.work.resources import ResourceTable, StoredResource
from tts2face.serving.work.run import RESOURCES


def resource(owner: str = "ann", name: str = "a", content: str = "c" * 64) -> StoredResource:
    return StoredResource(owner, "face", name, content, "", 10, {"identities": ["ä"]})


def test_the_table_holds_in_both_databases(database: str) -> None:  # noqa: F811
    table = ResourceTable(database_url(database))
    kept: list[str] = []
    sizes: list[int] = []

    def add(one: StoredResource) -> bool:
        return table.add(one, check=lambda usage: sizes.append(usage.n_bytes), keep=lambda: kept.append(one.name))

    assert [add(resource()), add(resource()), add(resource("bob")), add(resource(name="b"))] == [
        True,
        False,
        True,
        True,
    ]
    assert (kept, sizes) == (["a", "a", "b"], [0, 0, 10])
    assert [one.name for one in table.select("face", "ann")] == ["a", "b"]
    assert [one.owner for one in table.select("face", None)] == ["ann", "bob", "ann"]
    found = table.find("ann", "face", "a")
    assert found is not None
    assert (found.description, found.created > 1e9) == ({"identities": ["ä"]}, True)
    removed: list[str] = []
    for owner, name in (("ann", "a"), ("ann", "b"), ("ann", "b"), ("bob", "a")):
        table.remove(owner, "face", name, removed.append)
    table.close()
    assert removed == ["c" * 64]  # with the last that had it


def test_files_without_a_resource_are_removed_after_a_time(settings: ServiceSettings, tmp_path: Path) -> None:
    """As after a crash between the storage of a file and its row."""
    settings.data_folder.mkdir(parents=True)
    library = Library(settings)
    blobs = open_blobs(settings.store_place, RESOURCES, cache=tmp_path / "cache")
    lost, kept = blobs.put(b"lost"), blobs.put(b"kept")
    table = ResourceTable(database_url(settings.database_place))
    table.add(resource(content=kept), check=lambda usage: None, keep=lambda: None)
    table.close()
    assert library.remove_unused_files(older_than_s=3600.0) == 0
    assert library.remove_unused_files(older_than_s=-10.0) == 1
    assert (blobs.has(lost), blobs.has(kept)) == (False, True)
    library.close()


def test_a_refused_addition_leaves_nothing(tmp_path: Path) -> None:
    table = ResourceTable(database_url(tmp_path / "a.sqlite"))

    def refuse() -> None:
        raise BackendError("the disk is full")

    with pytest.raises(BackendError, match="the disk is full"):
        table.add(resource(), check=lambda usage: None, keep=refuse)
    assert table.find("ann", "face", "a") is None
    table.close()


def test_a_database_that_is_away_is_said_and_the_services_own_models_do_without(settings: ServiceSettings) -> None:

    away = replace(settings, keys=None, database="postgresql://nobody@127.0.0.1:9/none")
    library = Library(away)
    assert library.resolve(LOCAL_KEY, "face", "head") == ("head", {})
    with pytest.raises(BackendError, match="the database cannot be reached"):
        library.resolve(LOCAL_KEY, "face", "mine")
