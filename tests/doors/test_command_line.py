"""The command line as a person uses it."""

import io
import json
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from cli.main import run
from cli.process import EXIT_CODES
from lexicon import errors
from tests.running import eventually
from tests.world import World
from tts2face.picture.options import Picture
from tts2face.request import Request, option_fields

COMMAND = [sys.executable, "-c", "from cli.main import main; main()"]
SMALL = ["--size", "64x64", "--fps", "5"]
WROTE = r"wrote .*: \d+\.\d s, \d+ frames, made in \d+\.\d s \(\d+\.\d x real time\)"


def test_help_names_every_option_and_is_quick(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["--help"]) == 0
    captured = capsys.readouterr().out
    for options in (Request, Picture):
        for option in option_fields(options):
            assert option.name == "text" or f"--{option.name.replace(chr(95), chr(45))}" in captured
    loaded = "import sys; from cli.main import run; run(['--help']); print(*sys.modules)"
    modules = subprocess.run([sys.executable, "-c", loaded], capture_output=True, text=True, check=True).stdout
    heavy = {"numpy", "numba", "scipy", "onnxruntime", "av", "PIL", "hibari", "hama", "pyvista", "parselmouth"}
    assert not heavy & set(modules.splitlines()[-1].split())


def test_every_kind_of_error_has_an_exit_code() -> None:
    kinds = errors.Tts2faceError.__subclasses__()
    assert len(kinds) == 3
    assert {EXIT_CODES[kind] for kind in kinds} == {2, 3, 4}


@pytest.mark.parametrize(
    ("arguments", "code", "reason"),
    [
        (["", "--out", "x.mp4"], 2, "the text is empty"),
        (["Hi.", "--out", "x.mp4", "--language", "tlh"], 2, "no language 'tlh'"),
        (["<speak><break>Hi.</speak>", "--out", "x.mp4"], 2, "mismatched tag in line 1; close <break>"),
        (["<speak xml:lang='fr'>Salut.</speak>", "--out", "x.mp4"], 2, "the text names the language fr, not en-us"),
        (["Hi [pause 1] you.", "--audio", "latin.txt", "--out", "x.mp4"], 2, "have no effect on a recording"),
        (["Hi.", "--style", "ears=a", "--out", "x.mp4"], 2, "no feature 'ears'"),
        (["Hi.", "--gain", "head=9", "--out", "x.mp4"], 2, "the gain of head must lie between 0 and 3, not 9"),
        (["Hi.", "--expression", "sad=1@3-1", "--out", "x.mp4"], 2, "must end after it begins"),
        (["Hi.", "--timeline", "none.json", "--out", "x.mp4"], 2, "cannot read the timeline none.json"),
        (["Hi.", "--timeline", "plan.json", "--out", "x.mp4"], 3, "plan.json: two spans of head overlap"),
        (["Hi.", "--idle", "5", "--out", "x.mp4"], 2, "--idle cannot be combined with text or --audio"),
        (["--idle", "5", "--explain", "x.json"], 2, "the text is empty"),
        (["Hi.", "--no-gestures", "--style", "calm", "--out", "x.mp4"], 2, "have no effect with --gestures none"),
        (["Hi.", "--gestures", "ju2009", "--out", "x.mp4"], 2, "gestures must be fields, ju2008, noise or none"),
        (["Hi.", "--gestures", "ju2008", "--noise", "--out", "x.mp4"], 2, "cannot be combined with --noise; remove"),
        (["Hi.", "--noise", "--no-gestures", "--out", "x.mp4"], 2, "--noise cannot be combined with --no-gestures"),
        (["Hi.", "--out", "x.avi"], 2, "unknown suffix .avi"),
        (["Hi.", "--out", "none/x.mp4"], 2, "no folder none"),
        (["Hi.", "--out", "x.mp4", "--talker", "none.talker"], 2, "no talker file none.talker"),
        (["Hi.", "--out", "x.mp4", "--talker", "junk.talker"], 3, "junk.talker is damaged or not a talker file"),
        (["Hi.", "--out", "x.mp4", "--talker", "face.talker"], 3, "face.talker is not a talker file"),
        (["Hi.", "--out", "x.mp4", "--talker", "old.talker"], 3, "of version 0, not 1"),
        (["Hi.", "--out", "x.mp4", "--face", "half.face"], 3, "half.face is damaged or not a face file"),
        (["Hi.", "--out", "x.mp4", "--face", "nobody"], 2, "no face 'nobody'"),
        (["Hi.", "--out", "x.mp4", "--identity", "nobody"], 2, "no identity 'nobody'"),
        (["Hi.", "--out", "x.mp4", "--fps", "0"], 2, "fps must lie between 1 and 120, not 0"),
        (["Hi.", "--out", "x.mp4", "--size", "9x9"], 2, "even numbers from 16 to 4096"),
        (["Hi.", "--out", "x.mp4", "--fps", "many"], 2, 'unable to convert "many"'),
        (["Hi.", "--out", "x.mp4", "--exemplars", "2.5"], 2, '"2.5" is not a whole number'),
        (["corpus", "evaluate", "--recordings", ".", "--folds", "2.5"], 2, '"2.5" is not a whole number'),
        (["Hi.", "--out", "x.mp4", "--flag", "1"], 2, "--flag"),
        (["Hi."], 2, "there is no output; add --out"),
        (["Hi.", "--file", "x.txt", "--out", "x.mp4"], 2, "--file cannot be combined with a text"),
        (["--file", "none.txt", "--out", "x.mp4"], 2, "cannot read the text from none.txt"),
        (["--file", "latin.txt", "--out", "x.mp4"], 2, "latin.txt is not UTF-8 text (byte 1)"),
    ],
)
def test_invalid_input_gives_one_sentence_and_no_output(
    arguments: list[str], code: int, reason: str, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from tts2face.storage.shipped import SHIPPED_FOLDER
    from tts2face.storage.tensors import write_tensors

    (here / "junk.talker").write_bytes(b"no talker at all")
    (here / "face.talker").write_bytes((SHIPPED_FOLDER / "head.face").read_bytes())
    (here / "half.face").write_bytes((SHIPPED_FOLDER / "head.face").read_bytes()[:100_000])
    (here / "latin.txt").write_bytes(b"h\xe9llo")
    spans = [{"feature": "head", "style": "calm", "start": start} for start in (0, 1)]
    (here / "plan.json").write_text(json.dumps({"spans": spans}))
    write_tensors(here / "old.talker", "talker", 0, {}, {})
    before = set(here.iterdir())
    assert run(arguments) == code
    captured = capsys.readouterr()
    assert reason in captured.err
    assert len(captured.err.strip().splitlines()) == 1
    assert set(here.iterdir()) == before


def test_a_folder_that_cannot_be_written_is_named(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    if os.geteuid() == 0:
        pytest.skip("root may write everywhere")
    locked = here / "locked"
    locked.mkdir(mode=0o555)
    assert run(["Hi.", "--out", "locked/x.mp4"]) == 4
    assert "cannot write locked/x.mp4" in capsys.readouterr().err


def test_text_from_a_file(tones: World, here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (here / "text.txt").write_text("\ufeffHello.", encoding="utf-8")
    assert run(["--file", "text.txt", *SMALL, *tones.flags, "--out", "clip.mp4"]) == 0
    assert re.search(WROTE, capsys.readouterr().err)
    assert (here / "clip.mp4").stat().st_size > 1000


@pytest.mark.parametrize("words", [[], ["-"]])
def test_text_from_standard_input(
    words: list[str], tones: World, here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(b"Hello.")))
    assert run([*words, *tones.flags, "--out", "said.wav"]) == 0
    assert re.search(WROTE, capsys.readouterr().err)
    assert (here / "said.wav").stat().st_size > 1000


def test_an_interruption_leaves_no_files(world: World, here: Path) -> None:
    text = "This is a rather long sentence that takes some time to speak. " * 200
    command = [*COMMAND, text, *world.flags, "--out", "x.mp4"]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env={**os.environ, **world.environment})
    eventually(lambda: list(here.glob(".x*")))
    process.send_signal(signal.SIGINT)
    _, captured = process.communicate(timeout=60)
    assert process.returncode == 130, captured
    assert "interrupted; an output that was not complete yet is as it was before" in captured
    assert list(here.iterdir()) == []


def test_an_explanation_names_recorded_phones(tones: World, here: Path) -> None:
    assert run(["Bob met.", *tones.flags, "--explain", "why.json", "--quiet"]) == 0
    shown = json.loads((here / "why.json").read_text(encoding="utf-8"))
    assert [phone["phone"] for phone in shown if phone["phone"] != "sil"] == ["b", "ɑ", "b", "m", "ɛ", "t"]
    for phone in shown:
        assert phone["tokens"]
        assert sum(token["weight"] for token in phone["tokens"]) == pytest.approx(1, abs=1e-6)
