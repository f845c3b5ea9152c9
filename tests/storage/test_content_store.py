"""Files by name in a folder and in a bucket, and folders as caches; for buckets of providers see test_buckets."""

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from lexicon.errors import BackendError, InputError
from tests.packages import needs
from tts2face.storage.content_store import ContentStore, FolderStore, content_hash, divided, open_content_store

NAME = divided("abcdef.bin")
Opens = Callable[[str], ContentStore]


@pytest.fixture(params=["folder", "bucket"])
def opened(request: pytest.FixtureRequest, tmp_path: Path) -> Opens:
    """Opens a folder of a store."""
    if request.param == "bucket":
        needs("obstore")
    place = str(tmp_path / "store")
    return lambda folder: open_content_store(place if request.param == "folder" else f"file://{place}", folder)


def test_bytes_and_files_are_stored_listed_lent_and_removed(opened: Opens, tmp_path: Path) -> None:
    store, given = opened("results"), tmp_path / "given"
    assert (store.get(NAME, 10), store.has(NAME), list(store.entries())) == (None, False, [])
    with pytest.raises(FileNotFoundError):
        store.lend(NAME, tmp_path / "copy")
    for content in (b"first", b"second"):
        store.put(NAME, content)
    assert (store.get(NAME, 10), store.get(NAME, 3), store.has(NAME)) == (b"second", b"sec", True)
    given.write_bytes(b"file")
    store.add("one", given)
    assert store.lend("one", tmp_path / "copy").read_bytes() == b"file"
    assert sorted((one.name, one.n_bytes) for one in store.entries()) == [(NAME, 6), ("one", 4)]
    assert list(opened("uploads").entries()) == []
    for _ in range(2):
        store.delete(NAME)
    assert [one.name for one in store.entries()] == ["one"]
    assert (tmp_path / "store" / "results" / "one").read_bytes() == b"file"


def test_stores_that_cannot_be_opened_or_written_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="there is no store ftp://x"):
        open_content_store("ftp://x")
    (tmp_path / "file").touch()
    with pytest.raises(BackendError, match=r"cannot write the folder .*file: Not a directory; change its permissions"):
        FolderStore(tmp_path / "file").check()


def test_a_draft_is_not_listed_until_it_is_kept(tmp_path: Path) -> None:
    store = FolderStore(tmp_path / "store")
    with store.draft() as draft:
        draft.path.write_bytes(b"begun")
        store.remove_drafts()  # this one is locked
        assert draft.path.exists()
        assert list(store.entries()) == []
        store.keep(draft, NAME)
    with store.draft():
        pass
    assert [path.name for path in store.folder.rglob("*") if path.is_file()] == ["abcdef.bin"]


def filled(folder: Path) -> FolderStore:
    """Files aa, bb, cc of 10 bytes, used 3, 2 and 1 hours ago."""
    store = FolderStore(folder)
    for hours, name in ((3, "aa"), (2, divided("bb")), (1, "cc")):
        store.put(name, bytes(10))
        status = store.path(name).stat()
        os.utime(store.path(name), (status.st_atime - hours * 3600, status.st_mtime - hours * 3600))
    return store


@pytest.mark.parametrize(
    ("limits", "left"),
    [
        ({}, ["aa", "bb", "cc"]),
        ({"max_bytes": 25}, ["bb", "cc"]),
        ({"max_bytes": 5}, []),
        ({"max_bytes": 5, "kept": ["aa"]}, ["aa"]),
        ({"max_files": 1}, ["cc"]),
        ({"max_files": 1, "least_age_s": 9000}, ["bb", "cc"]),
    ],
)
def test_the_files_used_last_stay(limits: dict[str, object], left: list[str], tmp_path: Path) -> None:
    store = filled(tmp_path)
    assert store.prune(**limits) == 10 * len(left)  # type: ignore[arg-type]
    assert sorted(Path(one.name).name for one in store.entries()) == left


def test_a_use_counts_and_keeps_the_time_of_storage(tmp_path: Path) -> None:
    store = filled(tmp_path)
    before = store.path("aa").stat().st_mtime_ns
    store.touch("aa")
    store.prune(max_files=1)
    assert [one.name for one in store.entries()] == ["aa"]
    assert store.path("aa").stat().st_mtime_ns == before


def test_the_hash_of_a_file_follows_its_content(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes(b"1")
    first = content_hash(path)
    path.write_bytes(b"12")
    assert first != content_hash(path)
    assert first == "6b86b273ff34fce19d6b804eff5a3f5747ada4eaa22f1d49c01e52ddb7875b4b"
