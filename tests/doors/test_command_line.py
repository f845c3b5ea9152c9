"""The command line as a person uses it."""

import functools
import json
import os
import re
import shlex
import signal
import subprocess
import sys
import time
import wave
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path

import pytest

from cli.main import run
from cli.process import EXIT_CODES
from lexicon import errors
from tests.docs.blocks import lines_that_need_a_person
from tts2face.render.picture import Picture
from tts2face.request import Request
from tts2face.video.landmark_models import find_bundle
from tts2face.video.media import read_sound

COMMAND = [sys.executable, "-c", "from cli.main import main; main()"]
SMALL = ["--size", "64x64", "--fps", "5"]
N_RECORDINGS = 6
OUTPUTS = {".talker", ".palette", ".html", ".face"}  # what the README's commands write and others read
BUILT_BY = {"me.talker": "--appearance", "mine.palette": "corpus gestures"}


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def readme_commands() -> list[str]:
    return lines_that_need_a_person()


@pytest.fixture(scope="module")
def materials(rendered_takes: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The files that the README's commands read, from rendered takes."""
    folder = tmp_path_factory.mktemp("materials")
    (folder / "chapter.txt").write_text("Chapter one. It was late.", encoding="utf-8")
    (folder / "speech.txt").write_text("bin blue at f two now", encoding="utf-8")
    take = rendered_takes / "clips" / "bbaf2n.mkv"
    sound = read_sound(take, 16_000)
    with wave.open(str(folder / "speech.wav"), "wb") as file:
        file.setparams((1, 2, sound.rate, 0, "NONE", ""))
        file.writeframes((sound.samples * 32767).astype("<i2").tobytes())
    for name in ("take.mp4", "me.mp4"):
        (folder / name).symlink_to(take)
    few = folder / "recordings"
    (few / "clips").mkdir(parents=True)
    (few / "align").mkdir()
    rows = (rendered_takes / "manifest.csv").read_text(encoding="utf-8").splitlines()[: 1 + N_RECORDINGS]
    (few / "manifest.csv").write_text("\n".join(rows), encoding="utf-8")
    for row in rows[1:]:
        for part in (f"clips/{row.split(',')[0]}.mkv", f"align/{row.split(',')[0]}.align"):
            (few / part).symlink_to(rendered_takes / part)
    return folder


@pytest.fixture(scope="module")
def built(materials: Path) -> Callable[[str], None]:
    """Runs a command of the README in the folder of the materials, once: what it makes, other commands read."""

    @functools.cache
    def make(line: str) -> None:
        done = run_line(line, materials)
        assert done.returncode == 0, done.stderr

    return make


def run_line(line: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """A command of the README, at a small size."""
    echoed, _, command = line.rpartition("| ")
    words = shlex.split(command)[1:]
    if words[0] not in {"phones", "corpus", "report", "voices", "identities", "styles"}:
        words += SMALL
    given = shlex.split(echoed)[1] if echoed else None
    return subprocess.run([*COMMAND, *words], cwd=folder, input=given, capture_output=True, text=True, check=False)


@pytest.mark.parametrize("line", readme_commands())
def test_every_command_of_the_readme_works(
    line: str, here: Path, materials: Path, built: Callable[[str], None]
) -> None:
    sources = {name: sign for name, sign in BUILT_BY.items() if name in line and sign not in line}
    if "corpus" in line or "mimic" in line or sources:
        require_landmark_model()
    for sign in sources.values():
        built(*(one for one in readme_commands() if sign in one))
    if any(sign in line for sign in BUILT_BY.values()):
        folder = materials
        built(line)
    else:
        folder = here
        for path in materials.iterdir():
            if path.suffix not in OUTPUTS or path.name in sources:
                (here / path.name).symlink_to(path)
        done = run_line(line.replace("--hold-out 100", "--hold-out 2"), here)
        assert done.returncode == 0, done.stderr
    words = shlex.split(line)
    for flag in ("--out", "--explain", "--report"):
        if flag in words:
            assert (folder / words[words.index(flag) + 1]).exists()


def require_landmark_model() -> None:
    pytest.importorskip("ai_edge_litert", reason="needs `pip install 'tts2face[capture]'`")
    try:
        find_bundle()
    except errors.BackendError as missing:
        pytest.skip(str(missing))


def test_help_names_every_option_and_is_quick(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["--help"]) == 0
    captured = capsys.readouterr().out
    for options in (Request, Picture):
        for option in fields(options):
            assert option.name == "text" or f"--{option.name.replace(chr(95), chr(45))}" in captured
    loaded = "import sys; from cli.main import run; run(['--help']); print(*sys.modules)"
    modules = subprocess.run([sys.executable, "-c", loaded], capture_output=True, text=True, check=True).stdout
    heavy = {"numpy", "numba", "scipy", "onnxruntime", "av", "PIL", "hibari", "pocketsphinx", "pyvista", "parselmouth"}
    assert not heavy & set(modules.splitlines()[-1].split())


def test_every_kind_of_error_has_an_exit_code() -> None:
    kinds = errors.Tts2faceError.__subclasses__()
    assert len(kinds) == 3
    assert {EXIT_CODES[kind] for kind in kinds} == {2, 3, 4}


@pytest.mark.parametrize(
    ("arguments", "code", "reason"),
    [
        (["", "--out", "x.mp4"], 2, "the text is empty"),
        (["...", "--out", "x.mp4"], 2, "nothing to say"),
        (["Hi.", "--out", "x.mp4", "--language", "tlh"], 2, "no language 'tlh'"),
        (["Привет", "--out", "x.mp4"], 2, "cannot read"),
        (["Hi [pause x].", "--out", "x.mp4"], 2, "cannot read the mark [pause x]"),
        (["Hi [style:ears=a]you[/style].", "--out", "x.mp4"], 2, "no feature 'ears'"),
        (["<speak><voice name='Jo'>Hi.</voice></speak>", "--out", "x.mp4"], 2, "SSML, line 1: there is no voice 'Jo'"),
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
    from tts2face.storage.files import SHIPPED_FOLDER
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


def test_text_from_standard_input_and_from_a_file(here: Path) -> None:
    (here / "text.txt").write_text("\ufeffHello.", encoding="utf-8")
    for words, standard_input in ((["--file", "text.txt"], ""), ([], "Hello."), (["-"], "Hello.")):
        out = here / f"{len(words)}{len(standard_input)}.mp4"
        done = subprocess.run(
            [*COMMAND, *words, "--out", str(out), *SMALL],
            input=standard_input,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        assert re.search(r"wrote .*: \d+\.\d s, \d+ frames, made in \d+\.\d s \(\d+\.\d x real time\)", done.stderr)
        assert out.stat().st_size > 1000


def test_an_interruption_leaves_no_files(here: Path) -> None:
    text = "This is a rather long sentence that takes some time to speak. " * 20
    process = subprocess.Popen([*COMMAND, text, "--out", "x.mp4"], stderr=subprocess.PIPE, text=True)
    deadline = time.monotonic() + 60
    while not list(here.glob(".x*")) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert list(here.glob(".x*"))
    process.send_signal(signal.SIGINT)
    _, captured = process.communicate(timeout=60)
    assert process.returncode == 130, captured
    assert "interrupted; no output was written" in captured
    assert list(here.iterdir()) == []


def test_an_explanation_names_recorded_phones(here: Path) -> None:
    assert run(["Bob may.", "--explain", "why.json", "--quiet"]) == 0
    shown = json.loads((here / "why.json").read_text(encoding="utf-8"))
    assert [phone["phone"] for phone in shown if phone["phone"] != "sil"] == ["b", "ɑ", "b", "m", "eɪ"]
    for phone in shown:
        assert phone["tokens"]
        assert sum(token["weight"] for token in phone["tokens"]) == pytest.approx(1, abs=1e-6)
