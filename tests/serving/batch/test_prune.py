"""Pruning of stores: what is removed, what stays, and what is refused."""

import json
import os
import time
from pathlib import Path

import pytest

from cli.main import run
from lexicon.errors import DataError, InputError
from tests.packages import needs
from tests.serving.batch.conftest import Planner
from tests.tones import LetterVoice
from tests.world import World
from tts2face.serving.batch.prune import MIN_AGE_S, prune_segments
from tts2face.serving.batch.run import SEGMENT_FOLDER, run_batch
from tts2face.serving.batch.segment_result import SegmentResult
from tts2face.serving.batch.store import Store, open_store
from tts2face.session.named_models import Models

WEEK_S = 7 * 86_400.0


def fill(store: Store, folder: Path, *addresses: str) -> None:
    for address in addresses:
        movie = folder / f"{address}.movie"
        movie.write_bytes(b"movie")
        store.put(address, movie, SegmentResult(10, 10.0))


def age(folder: Path, seconds: float) -> None:
    """Make all files of a folder older."""
    for path in folder.rglob("*"):
        if path.is_file():
            os.utime(path, (time.time() - seconds,) * 2)


def manifest(folder: Path, *addresses: str) -> Path:
    folder.mkdir()
    (folder / "manifest.json").write_text(json.dumps({"outputs": [], "segments": list(addresses)}))
    return folder


@pytest.mark.parametrize("scheme", ["", "file://"])
def test_only_old_segments_without_a_reference_are_removed(scheme: str, tmp_path: Path) -> None:
    if scheme:
        needs("obstore")
    folder = tmp_path / "store"
    store = open_store(f"{scheme}{folder}")
    old = ["aa" * 32, "bb" * 32, "cc" * 32]
    fill(store, tmp_path, *old)
    age(folder, 2 * WEEK_S)
    fill(store, tmp_path, "dd" * 32)
    out = manifest(tmp_path / "out", old[0])
    dry = prune_segments(store, [out], {old[1]}, WEEK_S, dry_run=True)
    assert len(list(store.entries())) == 4
    assert dry == prune_segments(store, [out], {old[1]}, WEEK_S)
    assert (dry.n_removed, dry.n_kept) == (1, 3)
    assert dry.n_bytes == 5 + len(json.dumps(SegmentResult(10, 10.0).as_json()))
    assert sorted(store.addresses()) == [old[0], old[1], "dd" * 32]
    assert not list(folder.glob(f"??/{old[2]}*"))


def test_unfinished_files_of_killed_processes_are_removed(tmp_path: Path) -> None:
    store = open_store(tmp_path / "store")
    scratch = store.scratch()
    assert scratch is not None
    (scratch / ".one.mov.tts2face-1").write_bytes(b"part")
    age(scratch, 2 * WEEK_S)
    (scratch / ".two.mov.tts2face-2").write_bytes(b"part")
    pruned = prune_segments(store, [manifest(tmp_path / "out")], (), WEEK_S)
    assert (pruned.n_removed, pruned.n_bytes) == (1, 4)
    assert [path.name for path in scratch.iterdir()] == [".two.mov.tts2face-2"]


@pytest.mark.server
def test_the_segments_of_a_batch_stay_and_it_runs_again_without_rendering(
    plan_of: Planner, voices: list[LetterVoice], world: World, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    models = Models(str(world.talker_file), str(world.face_file), palette=str(world.palette_file))
    plan = plan_of(per="file", models=models)
    run_batch(plan, out)
    age(out / SEGMENT_FOLDER, 2 * WEEK_S)
    pruned = prune_segments(open_store(out / SEGMENT_FOLDER), [out], (), WEEK_S)
    assert (pruned.n_removed, pruned.n_kept) == (0, len(plan.segments))
    (out / "one.mp4").unlink()
    assert run_batch(plan, out).n_rendered == 0


@pytest.mark.parametrize(
    ("content", "reason"),
    [("{", "manifest.json"), ('{"outputs": []}', "does not list its segments; run the batch again")],
)
def test_manifests_that_do_not_list_segments_are_refused(content: str, reason: str, tmp_path: Path) -> None:
    out = manifest(tmp_path / "out")
    (out / "manifest.json").write_text(content)
    with pytest.raises(DataError, match=reason):
        prune_segments(open_store(tmp_path / "store"), [out], (), WEEK_S)


def test_a_prune_that_could_remove_segments_in_use_is_refused(tmp_path: Path) -> None:
    store = open_store(tmp_path / "store")
    with pytest.raises(InputError, match=r"give --days 1 or more, not 0\.5"):
        prune_segments(store, [manifest(tmp_path / "out")], (), MIN_AGE_S / 2)
    with pytest.raises(InputError, match="give --outputs"):
        prune_segments(store, [], (), WEEK_S)
    with pytest.raises(InputError, match=f"there is no manifest.json in {tmp_path / 'other'}"):
        prune_segments(store, [tmp_path / "other"], (), WEEK_S)


def test_the_command_prunes_a_store_without_a_database(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    fill(open_store(tmp_path / "store"), tmp_path, "aa" * 32)
    age(tmp_path / "store", 2 * WEEK_S)
    out = manifest(tmp_path / "out")
    words = ["jobs", "prune", "--store", "store", "--outputs", str(out), "--days", "7"]
    assert run([*words, "--dry-run"]) == 0
    assert capsys.readouterr().out == "would remove 1 segments (0.0 MB); 0 stay\n"
    assert run(words) == 0
    assert capsys.readouterr().out == "removed 1 segments (0.0 MB); 0 stay\n"
    for arguments, reason in (
        (["--store", "nowhere", "--outputs", str(out)], "there is no store nowhere"),
        (["--outputs", str(out)], "--outputs has no effect without --store"),
    ):
        assert run(["jobs", "prune", *arguments]) == 2
        assert reason in capsys.readouterr().err
