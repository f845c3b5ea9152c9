"""Inputs are never replaced by outputs."""

import os
from pathlib import Path

import pytest

from lexicon.errors import InputError
from tts2face.storage.output_paths import refuse_overwriting


@pytest.fixture
def take(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "take.mp4"
    path.write_bytes(b"film")
    (tmp_path / "linked.mp4").symlink_to(path)
    os.link(path, tmp_path / "hard.mp4")
    (tmp_path / "sub").mkdir()
    return path


@pytest.mark.parametrize("name", ["take.mp4", "linked.mp4", "hard.mp4", "sub/../take.mp4", "./take.mp4"])
def test_an_output_that_is_an_input_is_refused(take: Path, name: str) -> None:
    with pytest.raises(InputError, match=r"--out .* would replace the take; choose another name"):
        refuse_overwriting({"--out": Path(name)}, {"the take": take})
    with pytest.raises(InputError, match=r"--out .* would replace the take; choose another name"):
        refuse_overwriting({"--out": take}, {"the take": name})


def test_two_outputs_of_one_name_are_refused(take: Path) -> None:
    with pytest.raises(InputError, match="--out and --explain are the same file"):
        refuse_overwriting({"--out": Path("new.json"), "--explain": Path("sub/../new.json")}, {})


def test_a_folder_that_holds_an_input_is_refused(take: Path) -> None:
    (take.parent / "sub" / "sound.wav").touch()
    with pytest.raises(InputError, match="would replace the folder that contains --audio"):
        refuse_overwriting({"--out": Path("sub")}, {"--audio": Path("sub/sound.wav")})


def test_a_possible_input_in_a_folder_of_inputs_is_refused(take: Path) -> None:
    for name in ("manifest.csv", "me.talker"):
        (take.parent / name).touch()
    with pytest.raises(InputError, match="would replace a file of --recordings"):
        refuse_overwriting({"--out": Path("manifest.csv")}, {"--recordings": take.parent})
    refuse_overwriting({"--out": Path("me.talker"), "--report": Path("new.csv")}, {"--recordings": take.parent})


def test_other_files_and_names_of_shipped_files_are_allowed(take: Path) -> None:
    refuse_overwriting(
        {"--out": Path("new.mp4"), "--explain": None}, {"the take": take, "--audio": None, "--talker": "sub"}
    )
    refuse_overwriting({"--out": Path("sub")}, {"--palette": "sub", "--background": "red"})
