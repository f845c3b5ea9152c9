"""The store of the studio's recordings."""

import json
import threading
from dataclasses import replace
from pathlib import Path

import pytest

from lexicon.errors import InputError
from tts2face.serving.studio.recordings import CHECKING, GOOD, REFUSED, WEAK, RecordingStore

PROMPTS = {
    "prompts": [{"text": f"Sentence {n}.", "phones": ["a"], "triphones": ["sil aa sil"]} for n in range(3)],
    "running": {"phones": {"a": 3}, "triphones": {"sil aa sil": 3}},
}


@pytest.fixture
def store(tmp_path):
    return RecordingStore(tmp_path / "studio")


def add(store: RecordingStore, number: str, at: int, content: bytes = b"video", kind: str = "video/webm;codecs=vp8"):
    upload = store.folder(number, "ada") / "upload"
    upload.write_bytes(content)
    take = store.add_take(number, at, upload, kind)
    assert not upload.exists()
    return take


def files(store: RecordingStore, number: str) -> set[str]:
    folder = store.folder(number, "ada")
    return {str(path.relative_to(folder)) for path in folder.rglob("take-*")}


def test_a_take_lies_where_its_state_says_and_accepted_ones_are_a_folder_for_corpus_build(store):
    number = store.create("ada", " Ada ", PROMPTS)
    assert store.name(number) == "Ada"
    take = add(store, number, 1)
    assert files(store, number) == {f"unchecked/{take.file}"}
    for state, folder in ((WEAK, "recordings"), (REFUSED, "refused"), (GOOD, "recordings")):
        store.judge(number, 1, replace(take, state=state, advice="Speak up.", key="abc"))
        assert f"{folder}/{take.file}" in files(store, number)
        transcript = store.path(number, store.takes(number)[1]).with_suffix(".txt")
        assert transcript.read_text() == "Sentence 1."
        assert store.takes(number)[1].advice == "Speak up."
    assert [(one.name, one.n_accepted, one.n_prompts) for one in store.entries("ada")] == [("Ada", 1, 3)]
    assert RecordingStore(store.folder(number, "ada").parents[1]).takes(number) == store.takes(number)


def test_a_take_recorded_again_replaces_the_files_of_the_earlier_one(store):
    number = store.create("ada", "Ada", PROMPTS)
    first = add(store, number, 0, b"first")
    cache = store.folder(number, "ada") / "cache"
    cache.mkdir()
    for name in ("k1-1.tracking", "k2-1.tracking"):
        (cache / name).write_bytes(b"landmarks")
    store.judge(number, 0, replace(first, state=GOOD, key="k1"))
    second = add(store, number, 0, b"second")
    assert files(store, number) == {f"unchecked/{second.file}"}
    assert [path.name for path in cache.iterdir()] == ["k2-1.tracking"]
    store.judge(number, 0, replace(first, state=REFUSED, key="k2"))  # the check of the first ends late
    assert store.takes(number)[0] == second
    assert list(cache.iterdir()) == []
    assert [one[1:] for one in store.unchecked()] == [(0, second)]


def test_deleting_leaves_no_file(store, tmp_path):
    number = store.create("ada", "Ada", PROMPTS)
    take = add(store, number, 0)
    store.judge(number, 0, replace(take, state=GOOD))
    store.delete_take(number, 0)
    store.delete_take(number, 0)
    assert files(store, number) == set()
    assert store.takes(number) == {}
    add(store, number, 2, kind="video/mp4")
    store.delete(number)
    store.judge(number, 2, replace(take, state=GOOD))  # a check that ends afterwards writes nothing
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == []


def test_takes_of_many_threads_are_all_kept(store):
    number = store.create("ada", "Ada", {**PROMPTS, "prompts": PROMPTS["prompts"] * 8})
    uploads = [store.folder(number, "ada") / f"upload-{at}" for at in range(24)]
    for upload in uploads:
        upload.write_bytes(b"video")
    threads = [
        threading.Thread(target=store.add_take, args=(number, at, upload, "video/webm"))
        for at, upload in enumerate(uploads)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(store.takes(number)) == list(range(24))
    assert all(take.state == CHECKING for take in store.takes(number).values())


def test_nobody_sees_the_recordings_of_another(store):
    number = store.create("ada", "Ada", PROMPTS)
    assert store.entries("eve") == []
    with pytest.raises(InputError, match=f"there is no recording '{number}'"):
        store.folder(number, "eve")
    with pytest.raises(InputError, match="there is no recording"):
        store.folder("../" + number, "ada")


@pytest.mark.parametrize(
    ("at", "kind", "message"),
    [
        (3, "video/webm", "there is no prompt 4; there are 3"),
        (-1, "video/webm", "there is no prompt 0"),
        (0, "text/html", "a take must be video/webm or video/mp4, not 'text/html'"),
    ],
)
def test_what_is_no_take_is_refused(store, at, kind, message):
    number = store.create("ada", "Ada", PROMPTS)
    with pytest.raises(InputError, match=message):
        add(store, number, at, kind=kind)
    assert store.takes(number) == {}


def test_a_name_is_needed(store, tmp_path):
    for name in (" ", "x" * 61):
        with pytest.raises(InputError, match="the name must have 1 to 60 characters"):
            store.create("ada", name, PROMPTS)
    assert not Path(tmp_path / "studio").exists()


def test_the_manifest_is_json_that_others_can_read(store):
    number = store.create("ada", "Ada", PROMPTS)
    add(store, number, 0)
    manifest = json.loads((store.folder(number, "ada") / "manifest.json").read_text())
    assert manifest["name"] == "Ada"
    assert list(manifest["takes"]) == ["0"]


def test_only_english_takes_have_a_transcript(store):
    for language, has_transcript in (("en-gb", True), ("de", False)):
        number = store.create("ada", "Ada", {**PROMPTS, "language": language})
        take = add(store, number, 0)
        store.judge(number, 0, replace(take, state=GOOD))
        names = {Path(name).suffix for name in files(store, number)}
        assert names == ({".webm", ".txt"} if has_transcript else {".webm"})
