"""Files by the hash of their content, in a folder and in a bucket."""

import hashlib
import time
from pathlib import Path

import pytest

from tests.packages import reason

pytest.importorskip("obstore", reason=reason("obstore"))

from lexicon.errors import BackendError
from tts2face.serving.work.blobs import BlobStore, MissingBlobError, open_blobs
from tts2face.storage.bucket import BucketStore
from tts2face.storage.content_store import FolderStore

CONTENT = b"some bytes"
SHA256 = hashlib.sha256(CONTENT).hexdigest()


@pytest.fixture(params=["folder", "bucket"])
def blobs(request: pytest.FixtureRequest, tmp_path: Path) -> BlobStore:
    place = str(tmp_path / "store")
    return open_blobs(place if request.param == "folder" else f"file://{place}", "results", cache=tmp_path / "cache")


def test_a_file_is_stored_by_its_content(blobs: BlobStore, tmp_path: Path) -> None:
    path = tmp_path / "given"
    path.write_bytes(CONTENT)
    assert not blobs.has(SHA256)
    assert blobs.put(path) == blobs.put(CONTENT) == SHA256
    assert blobs.has(SHA256)
    assert blobs.fetch(SHA256).read_bytes() == CONTENT == path.read_bytes()
    assert blobs.fetch(SHA256).name == SHA256
    assert (tmp_path / "store" / "results" / SHA256[:2] / SHA256).read_bytes() == CONTENT  # where it ever was
    ((name, stored_s),) = blobs.entries()
    assert name == SHA256
    assert abs(stored_s - time.time()) < 60.0
    blobs.delete(SHA256)
    blobs.delete(SHA256)
    assert not blobs.has(SHA256)
    with pytest.raises(MissingBlobError, match=f"the file {SHA256[:12]} is not in"):
        blobs.fetch(SHA256)


def test_kinds_do_not_share_their_files(tmp_path: Path) -> None:
    results, uploads = open_blobs(tmp_path, "results"), open_blobs(tmp_path, "uploads")
    results.put(CONTENT)
    assert not uploads.has(uploads.put(CONTENT)[::-1])
    results.delete(SHA256)
    assert uploads.fetch(SHA256).read_bytes() == CONTENT


@pytest.mark.parametrize("name", ["", "../" * 20 + "etc/passwd", SHA256[:-1], SHA256.upper(), f"{SHA256}\n"])
def test_nothing_but_a_hash_becomes_a_path(blobs: BlobStore, name: str) -> None:
    blobs.put(CONTENT)
    for call in (blobs.fetch, blobs.has, blobs.delete):
        with pytest.raises(MissingBlobError, match="is no SHA-256"):
            call(name)


def test_a_damaged_file_is_refused_and_removed(tmp_path: Path) -> None:
    blobs = open_blobs(tmp_path, "results")
    path = blobs.fetch(blobs.put(CONTENT))
    path.write_bytes(CONTENT[::-1] + b"!")
    with pytest.raises(BackendError, match="was damaged; make it again"):
        blobs.fetch(SHA256)
    assert not blobs.has(SHA256)


def test_a_damaged_copy_of_a_bucket_is_fetched_again(tmp_path: Path) -> None:
    blobs = open_blobs(f"file://{tmp_path}/store", "results", cache=tmp_path / "cache")
    blobs.fetch(blobs.put(CONTENT)).write_bytes(b"other")
    assert blobs.fetch(SHA256).read_bytes() == CONTENT


def test_copies_of_a_bucket_are_bounded_and_the_used_ones_stay(tmp_path: Path) -> None:
    blobs = BlobStore(
        BucketStore(f"file://{tmp_path}/store", "results"), FolderStore(tmp_path / "cache"), max_bytes=2500
    )
    first, second = blobs.put(bytes(1000)), blobs.put(b"2" * 1000)
    blobs.fetch(first)
    third = blobs.put(b"3" * 1000)
    assert {path.name for path in (tmp_path / "cache").glob("??/*")} == {first, third}
    large = blobs.put(b"4" * 3000)  # larger than all copies together
    assert [path.name for path in (tmp_path / "cache").glob("??/*")] == [large]
    assert blobs.fetch(second).read_bytes() == b"2" * 1000


def test_an_interrupted_put_leaves_nothing(blobs: BlobStore, tmp_path: Path) -> None:
    with pytest.raises(BackendError, match="cannot write"):
        blobs.put(tmp_path)  # a folder cannot be read
    assert not [path for path in tmp_path.rglob("*") if path.is_file()]
