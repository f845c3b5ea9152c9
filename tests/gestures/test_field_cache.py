"""Indexes of fields in the user's cache folder."""

from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from tts2face.gestures import field
from tts2face.gestures.field import Field, FieldOptions, build_field, initial_state, sample_field
from tts2face.storage import array_cache
from tts2face.storage.array_cache import fingerprint, read_cached, write_cached

LENGTHS = np.array([150, 90, 200], np.int32)


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(field, "MIN_CACHED_MOMENTS", 1)
    return tmp_path / "tts2face" / "field"


def made_field(seed: int = 0) -> Field:
    generator = np.random.default_rng(seed)
    motion, sound = (generator.normal(size=(LENGTHS.sum(), n)).cumsum(axis=0).astype(np.float32) for n in (3, 1))
    return build_field(motion, sound, LENGTHS, FieldOptions())


def sampled(made: Field) -> np.ndarray:
    chances = np.random.default_rng(1).uniform(size=60)
    return sample_field(made, initial_state(made, 0.5), np.zeros((60, 1), np.float32), chances)[0]


def test_a_field_is_indexed_once(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = made_field()
    assert len(list(cache.iterdir())) == 1
    monkeypatch.setattr(field, "_index_field", lambda *_: pytest.fail("indexed again"))
    again = made_field()
    for one in fields(Field):
        if one.name != "tree":
            np.testing.assert_array_equal(getattr(again, one.name), getattr(first, one.name))
    np.testing.assert_array_equal(sampled(again), sampled(first))
    with pytest.raises(pytest.fail.Exception, match="indexed again"):
        made_field(seed=1)


@pytest.mark.parametrize("name", ["tree_order", "tree_spans", "tree_axes", "tree_places", "axes"])
def test_a_wrong_index_is_computed_again(name: str, cache: Path) -> None:
    first = made_field()
    (path,) = cache.iterdir()
    arrays = dict(read_cached("field", field.CACHE_VERSION, path.name) or {})
    wrong = arrays[name][1:] if name in {"tree_places", "axes"} else arrays[name] + np.int32(10_000)
    write_cached("field", field.CACHE_VERSION, path.name, arrays | {name: wrong})
    np.testing.assert_array_equal(sampled(made_field()), sampled(first))
    repaired = read_cached("field", field.CACHE_VERSION, path.name)
    assert repaired is not None
    np.testing.assert_array_equal(repaired[name], arrays[name])


def test_a_damaged_file_and_a_folder_that_cannot_be_written_only_cost_time(cache: Path) -> None:
    first = made_field()
    (path,) = cache.iterdir()
    whole = path.read_bytes()
    for damaged in (b"damaged", whole[:-1] + bytes([whole[-1] ^ 1])):  # one bit of an array, of the right shape
        path.write_bytes(damaged)
        np.testing.assert_array_equal(sampled(made_field()), sampled(first))
        assert path.read_bytes() == whole
    path.unlink()
    cache.rmdir()
    cache.write_bytes(b"a file where the folder should be")
    np.testing.assert_array_equal(sampled(made_field()), sampled(first))


def test_the_oldest_files_are_removed(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(array_cache, "MAX_FILES", 3)
    for number in range(5):
        write_cached("field", 1, str(number), {"a": np.zeros(1)})
    assert sorted(path.name for path in cache.iterdir()) == ["2", "3", "4"]


def test_fingerprints_tell_contents_apart() -> None:
    rows = np.arange(6.0)
    contents = [[rows], [rows.astype(np.float32)], [rows.reshape(2, 3)], [rows[:3], rows[3:]], ["a", "b"], ["ab"]]
    assert len({fingerprint(content) for content in contents}) == len(contents)
