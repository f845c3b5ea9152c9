"""Stores of segments: a folder, by path and by URL; for buckets see test_buckets."""

from pathlib import Path

import pytest

from lexicon.errors import InputError
from tests.packages import needs
from tts2face.serving.batch.segment_result import SegmentResult
from tts2face.serving.batch.store import open_store

ADDRESS = "ab" * 32
RESULT = SegmentResult(15, 10.0, 1.1, 1.4, 0.0, 0.0, ("a warning",), 2.5)


@pytest.mark.parametrize("kind", ["folder", "url"])
def test_a_segment_is_stored_whole_fetched_listed_and_removed(kind: str, tmp_path: Path) -> None:
    if kind == "url":
        needs("obstore")
    place = tmp_path / "store"
    store = open_store(place if kind == "folder" else f"file://{place}")
    assert store.result(ADDRESS) is None
    assert list(store.addresses()) == []
    for _ in range(2):  # storing twice costs time and nothing else
        movie = tmp_path / "new.mov"
        movie.write_bytes(b"movie")
        store.put(ADDRESS, movie, RESULT)
        assert not movie.exists()
    assert store.result(ADDRESS) == RESULT
    assert store.fetch(ADDRESS, tmp_path).read_bytes() == b"movie"
    assert list(store.addresses()) == [ADDRESS]
    assert {path.name for path in (place / "ab").iterdir()} == {f"{ADDRESS}.mov", f"{ADDRESS}.json"}  # as ever
    store.remove(ADDRESS)
    store.remove(ADDRESS)
    assert store.result(ADDRESS) is None


def test_an_unknown_scheme_is_refused() -> None:
    with pytest.raises(InputError, match="there is no store ftp://x"):
        open_store("ftp://x")
