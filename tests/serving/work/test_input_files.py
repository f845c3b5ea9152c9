"""Files of jobs on another machine than the one that queued their segments."""

import shutil
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from threading import Barrier

import pytest

from tests.packages import reason

pytest.importorskip("obstore", reason=reason("obstore"))

from tts2face.serving.batch.segment import Segment, input_hashes
from tts2face.serving.work.blobs import (
    BlobStore,
    MissingBlobError,
    open_blobs,
    place_file,
    place_models,
    place_segment_files,
)
from tts2face.session.named_models import Models
from tts2face.storage.shipped import find_file


@pytest.fixture
def stores(tmp_path: Path) -> tuple[BlobStore, BlobStore]:
    """Files of jobs and uploaded models in a bucket, as another machine opens them."""
    place = f"file://{tmp_path}/bucket"
    return tuple(open_blobs(place, kind, cache=tmp_path / "cache") for kind in ("results", "resources"))  # type: ignore[return-value]


def test_a_segment_finds_its_files_on_another_machine(stores: tuple[BlobStore, BlobStore], tmp_path: Path) -> None:
    here, there = tmp_path / "here", tmp_path / "there"
    sound = place_file(stores, stores[0].put(b"sound"), "audio.wav", here)
    wall = place_file(stores, stores[0].put(b"picture"), "background.png", here)
    face = stores[1].fetch(stores[1].put(find_file("ada", "face")))
    models = Models(face=str(face))
    request, picture = {"audio": str(sound), "text": f"/a/{'ab' * 32}"}, {"background": str(wall)}
    segment = Segment(request, picture, models, 5, file_hashes=input_hashes(models, request, picture))
    shutil.rmtree(here)
    shutil.rmtree(tmp_path / "cache")
    found = place_segment_files(segment, lambda: stores, lambda: there)
    assert Path(found.request["audio"]).read_bytes() == b"sound"
    assert Path(found.picture["background"]).name == "background.png"
    assert found.request["text"] == request["text"]
    assert replace(found, file_hashes=found.input_hashes()).address == segment.address


def test_names_and_unknown_files_stay_as_they_are(stores: tuple[BlobStore, BlobStore], tmp_path: Path) -> None:
    segment = Segment({"text": "Hi.", "voice": "heart"}, {"background": "studio"}, Models(), 5)
    found = place_segment_files(segment, lambda: stores, lambda: tmp_path)
    assert (found.request, found.picture, found.models) == (segment.request, segment.picture, segment.models)
    with pytest.raises(MissingBlobError, match="is not in"):
        place_models({"talker": f"/elsewhere/{'ab' * 32}"}, lambda: stores)


def test_a_removed_copy_is_fetched_again(stores: tuple[BlobStore, BlobStore], tmp_path: Path) -> None:
    sha256 = stores[0].put(b"sound")
    first = place_file(stores, sha256, "../../audio.wav", tmp_path / "work")
    assert first == tmp_path / "work" / sha256 / "audio.wav"
    shutil.rmtree(tmp_path / "cache")  # a full cache
    assert place_file(stores, sha256, "audio.wav", tmp_path / "work").read_bytes() == b"sound"


def test_segments_place_the_same_file_at_the_same_time(stores: tuple[BlobStore, BlobStore], tmp_path: Path) -> None:
    sha256, n_threads = stores[0].put(b"sound"), 8
    stores[0].fetch(sha256)
    with ThreadPoolExecutor(n_threads) as threads:
        for number in range(50):
            begin = Barrier(n_threads)

            def place(folder: Path = tmp_path / str(number), begin: Barrier = begin) -> bytes:
                begin.wait()
                return place_file(stores, sha256, "one.wav", folder).read_bytes()

            assert {one.result() for one in [threads.submit(place) for _ in range(n_threads)]} == {b"sound"}
