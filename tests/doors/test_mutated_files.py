"""Wrong values in files and flags; some mutated files of each kind, of which `tests/fuzz` has thousands."""

import json
from pathlib import Path

import pytest

from cli.main import run
from tests.fuzz.mutated_files import failures, kinds

N_FILES = 40  # of each kind
PROJECT = {"format": "tts2face project", "version": 1}
RENDER = ("render", "p.json", "--out", "o.mp4")
WRONG = (  # arguments, what the file among them holds, exit code, what is printed
    (
        RENDER,
        json.dumps(PROJECT | {"request": {"style": 7}}),
        3,
        "p.json, request: style must be a text in quotes, not 7",
    ),
    (RENDER, json.dumps(PROJECT | {"request": {"seed": 10**390}}), 3, "is too large; the maximum is 1.8e308"),
    (
        RENDER,
        json.dumps(PROJECT | {"models": {"face": []}}),
        3,
        "p.json, models: face must be a text in quotes, not []",
    ),
    (("batch", "s.srt", "--cast", "c.toml", "--out", "o"), "[default]\nrate = 1" + "0" * 400, 3, "rate is too large a"),
    (
        ("serve", "--settings", "s.toml", "--show-config"),
        "port = " + "9" * 5000,
        2,
        "s.toml contains a number of thous",
    ),
    (("serve", "--settings", "s.toml", "--show-config"), "port = 0x" + "f" * 5000, 2, "port is too large a number"),
    (
        ("Hi.", "--timeline", "t.json", "--out", "o.csv"),
        '{"nods": [{"time": 1e999}]}',
        3,
        "the number 1e999 is too large",
    ),
    (("convert", "a.track.json", "o.wav"), '{"version": ' + "9" * 5000, 3, "a number of 5000 characters is too long"),
    (("Hi.", "--seed", "9" * 400, "--out", "o.wav"), "", 2, "seed is too large a number; the maximum is 1.8e308"),
)


def test_mutated_files_are_read_or_refused(tmp_path: Path) -> None:
    wrong = [f"{name} {one}" for name, kind in kinds(tmp_path).items() for one in failures(kind, tmp_path, N_FILES)]
    assert wrong == []


def test_a_wrong_value_is_one_sentence_and_writes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("s.srt").write_text("1\n00:00:01,000 --> 00:00:02,000\nHi.\n", encoding="utf-8")
    failed = []
    for arguments, content, code, reason in WRONG:
        name = next((one for one in arguments if one.endswith((".json", ".toml"))), "none.txt")
        Path(name).write_text(content, encoding="utf-8")
        before = sorted(tmp_path.iterdir())
        found, printed = run([*arguments]), capsys.readouterr()
        lines = printed.err.strip().splitlines()
        if (found, printed.out, len(lines)) != (code, "", 1) or reason not in printed.err:
            failed.append((arguments, found, printed))
        if sorted(tmp_path.iterdir()) != before:
            failed.append((arguments, "wrote a file"))
    assert failed == []
