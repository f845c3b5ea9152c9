"""The watch of the tests that kill workers: what counts as a segment that was rendered although it was stored."""

from pathlib import Path

from tests.serving.work.watch import StoreWatch
from tts2face.serving.batch.segment_result import SegmentResult
from tts2face.serving.batch.store import Store, open_store

ADDRESS = "ab" * 32
RESULT = SegmentResult(15, 10.0, 1.1, 1.4, 0.0, 0.0, ("a warning",), 2.5)


def test_a_stored_segment_that_is_rendered_again_counts(tmp_path: Path) -> None:
    store, watch = open_store(tmp_path), StoreWatch(tmp_path)
    for n_twice in (0, 1):
        render(store, tmp_path)
        watch.look()
        assert (len(watch.stored), watch.n_twice) == (1, n_twice)


def test_a_movie_whose_process_was_killed_before_its_result_does_not(tmp_path: Path) -> None:
    store, watch = open_store(tmp_path), StoreWatch(tmp_path)
    render(store, tmp_path)
    next(tmp_path.glob("ab/*.json")).unlink()
    assert store.result(ADDRESS) is None
    watch.look()
    render(store, tmp_path)
    watch.look()
    assert (len(watch.stored), watch.n_twice) == (1, 0)


def render(store: Store, folder: Path) -> None:
    movie = folder / "new.mov"
    movie.write_bytes(b"movie")
    store.put(ADDRESS, movie, RESULT)
