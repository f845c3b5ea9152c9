"""Temporary files: removal of those of killed processes, and never of those of running ones."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tts2face.storage.files import write_atomically
from tts2face.storage.temporary import NAME_INFIX, Temporary, remove_held

pytest.importorskip("fcntl", reason="without file locks nothing that was left behind is removed")

HOLD = """
import sys
from pathlib import Path
from tts2face.storage.temporary import Temporary
held = Temporary(Path(sys.argv[1]), is_folder=sys.argv[2] == "folder")
if held.path.is_dir():
    (held.path / "000000.png").touch()
print("ready", flush=True)
sys.stdin.read()
"""


def other_process(target: Path, kind: str) -> "subprocess.Popen[str]":
    child = subprocess.Popen(
        [sys.executable, "-c", HOLD, str(target), kind], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert child.stdout is not None
    assert child.stdout.readline() == "ready\n"
    return child


@pytest.mark.parametrize("kind", ["file", "folder"])
def test_only_files_of_killed_processes_are_removed(tmp_path: Path, kind: str) -> None:
    target = tmp_path / "clip.mp4"
    with other_process(target, kind) as child:
        (written,) = tmp_path.iterdir()
        with Temporary(target) as mine:
            assert {*tmp_path.iterdir()} == {written, mine.path}
        assert [*tmp_path.iterdir()] == [written]
        child.kill()
        child.wait()
        assert [*tmp_path.iterdir()] == [written]
    write_atomically(target, b"new")
    assert [*tmp_path.iterdir()] == [target]
    assert target.read_bytes() == b"new"


def test_only_files_of_the_same_target_are_removed(tmp_path: Path) -> None:
    for name in (f".other.mp4{NAME_INFIX}abc", ".clip.mp4.abc", f"clip.mp4{NAME_INFIX}abc"):
        (tmp_path / name).touch()
    (tmp_path / f".clip.mp4{NAME_INFIX}abc").touch()
    with Temporary(tmp_path / "clip.mp4") as mine:
        mine.replace(tmp_path / "clip.mp4")
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        ".clip.mp4.abc", f".other.mp4{NAME_INFIX}abc", "clip.mp4", f"clip.mp4{NAME_INFIX}abc",
    ]  # fmt: skip


def test_a_link_with_the_name_of_a_temporary_file_is_not_followed(tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("keep")
    (tmp_path / f".clip.mp4{NAME_INFIX}abc").symlink_to(tmp_path / "mine.txt")
    write_atomically(tmp_path / "clip.mp4", b"new")
    assert (tmp_path / "mine.txt").read_text() == "keep"


def test_a_file_never_replaces_a_folder(tmp_path: Path) -> None:
    (tmp_path / "kept").mkdir()
    (tmp_path / "kept" / "inside").touch()
    with Temporary(tmp_path / "kept") as mine, pytest.raises(OSError, match="kept"):
        mine.replace(tmp_path / "kept")
    assert (tmp_path / "kept" / "inside").exists()


def test_it_has_the_permissions_of_a_usual_file(tmp_path: Path) -> None:
    write_atomically(tmp_path / "clip.mp4", b"new")
    assert (tmp_path / "clip.mp4").stat().st_mode & 0o777 == 0o644


def test_a_name_of_the_greatest_length_can_be_written(tmp_path: Path) -> None:
    write_atomically(tmp_path / ("é" * 127), b"new")
    assert os.listdir(tmp_path) == ["é" * 127]


@pytest.mark.parametrize("is_folder", [False, True])
def test_one_that_another_process_removes_before_it_is_locked_is_made_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, is_folder: bool
) -> None:
    name = "mkdir" if is_folder else "touch"
    make, made = getattr(Path, name), []

    def make_and_remove(path: Path, **options: Any) -> None:
        make(path, **options)
        made.append(path)
        if len(made) == 1:
            path.rmdir() if is_folder else path.unlink()

    monkeypatch.setattr(Path, name, make_and_remove)
    with Temporary(tmp_path / "job", is_folder=is_folder) as mine:
        assert mine.path.exists()
    assert len(made) == 2
    with pytest.raises(FileNotFoundError):
        Temporary(tmp_path / "missing" / "job")


def test_one_that_is_interrupted_while_it_is_made_is_removed_with_all_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted_chmod(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(Path, "chmod", interrupted_chmod)
    with pytest.raises(KeyboardInterrupt):
        Temporary(tmp_path / "clip.mp4")
    assert len(list(tmp_path.iterdir())) == 1
    remove_held()
    assert list(tmp_path.iterdir()) == []


def test_an_earlier_folder_is_whole_until_the_new_one_takes_its_place(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An interruption at any renaming leaves the earlier pictures."""
    target = tmp_path / "pictures"
    target.mkdir()
    (target / "000000.png").write_bytes(b"earlier")
    rename, failures = os.replace, iter([True, False, True])

    def replace_once(source: Path, to: Path) -> None:
        if next(failures, False):
            raise KeyboardInterrupt
        rename(source, to)

    def write() -> None:
        with Temporary(target, is_folder=True) as new:
            (new.path / "000000.png").write_bytes(b"new")
            new.replace(target)

    monkeypatch.setattr(os, "replace", replace_once)
    for _ in range(2):  # at the first renaming, and at the second
        with pytest.raises(KeyboardInterrupt):
            write()
        assert [path.name for path in tmp_path.iterdir()] == ["pictures"]
        assert (target / "000000.png").read_bytes() == b"earlier"
    write()
    assert [path.name for path in tmp_path.iterdir()] == ["pictures"]
    assert (target / "000000.png").read_bytes() == b"new"
