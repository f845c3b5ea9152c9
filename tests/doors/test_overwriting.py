"""Every command refuses an output that is one of its inputs, before it reads or writes anything."""

import os
from pathlib import Path

import pytest

from cli.main import run

SPEAK = ["Hello.", "--quiet"]
COMMANDS = {
    "the text": ["--file", "in.mp4", "--out", "in.mp4"],
    "a transcript": ["--audio", "other.wav", "--transcript", "in.mp4", "--out", "in.mp4"],
    "a recording": ["--audio", "in.mp4", "--out", "in.mp4"],
    "a linked recording": ["--audio", "in.mp4", "--out", "link.mp4"],
    "a hard link": ["--audio", "in.mp4", "--out", "hard.mp4"],
    "a background": [*SPEAK, "--background", "frames/000000.png", "--out", "frames/"],
    "a timeline": [*SPEAK, "--timeline", "in.mp4", "--out", "in.mp4"],
    "a dictionary": [*SPEAK, "--dictionary", "in.mp4", "--out", "in.mp4"],
    "a palette": [*SPEAK, "--palette", "in.mp4", "--out", "in.mp4"],
    "a talker": [*SPEAK, "--talker", "in.mp4", "--out", "in.mp4"],
    "a face": [*SPEAK, "--face", "in.mp4", "--out", "in.mp4"],
    "an explanation": [*SPEAK, "--timeline", "in.json", "--explain", "in.json"],
    "a voice's settings": [*SPEAK, "--voice", "in", "--explain", "in.json"],
    "a take": ["mimic", "in.mp4", "--out", "in.mp4"],
    "the sound of a capture": ["mimic", "in.csv", "--audio", "in.mp4", "--out", "in.mp4"],
    "a report": ["corpus", "build", "in.mp4", "--out", "new.talker", "--report", "in.mp4"],
    "a transcript beside a film": ["corpus", "build", "in.mp4", "--out", "new.talker", "--report", "in.txt"],
    "the cloned talker": ["corpus", "clone", "in.talker", "grid_s1", "--out", "in.talker"],
    "a talker that gets audio maps": ["corpus", "audio-maps", ".", "--talker", "in.talker", "--out", "in.talker"],
    "a palette that gets a style": ["corpus", "gestures", ".", "--style", "a", "--palette", "in.palette", "--out",
                                    "in.palette"],
    "a still": ["corpus", "gestures", "other.wav", "--style", "a", "--still", "sad=in.png", "--out", "link.palette"],
    "an instant of a video": ["corpus", "gestures", "other.wav", "--style", "a", "--still", "sad=in.mp4@1.5", "--out",
                              "hard.palette"],
    "a manifest": ["corpus", "evaluate", "--recordings", ".", "--out", "in.csv"],
    "a model": ["corpus", "face", ".", "--model", "in.face", "--out", "in.face", "--consent", "me"],
    "a talker to study": ["report", "similarity", "in.json", "--out", "in.json"],
    "a palette to study": ["report", "gestures", "in.json", "--out", "in.json"],
    "a video to study": ["report", "retarget", "in.mp4", "--out", "in.mp4"],
}  # fmt: skip


@pytest.mark.parametrize("arguments", COMMANDS.values(), ids=COMMANDS)
def test_an_input_is_never_replaced(
    arguments: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    for suffix in ("mp4", "json", "csv", "txt", "talker", "palette", "face", "png"):
        (tmp_path / f"in.{suffix}").write_bytes(b"precious")
    (tmp_path / "other.wav").write_bytes(b"precious")
    (tmp_path / "link.mp4").symlink_to("in.mp4")
    (tmp_path / "link.palette").symlink_to("in.png")
    for name in ("hard.mp4", "hard.palette"):
        os.link(tmp_path / "in.mp4", tmp_path / name)
    (tmp_path / "frames").mkdir()
    (tmp_path / "frames" / "000000.png").write_bytes(b"precious")
    before = sorted(tmp_path.rglob("*"))
    assert run(arguments) == 2
    assert "would replace" in capsys.readouterr().err
    assert sorted(tmp_path.rglob("*")) == before
    assert all(path.read_bytes() == b"precious" for path in before if path.is_file())


def test_the_clip_and_its_explanation_are_two_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run([*SPEAK, "--out", "why.json", "--explain", "./why.json"]) == 2
    assert "--out and --explain are the same file" in capsys.readouterr().err
