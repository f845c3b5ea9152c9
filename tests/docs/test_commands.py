"""Every command line of the documentation is parsed by the real command line; those of README and cli.md are executed.

What is not executed here stands in `NOT_EXECUTED` with its reason; with recordings of people, `test_recorded_commands`
executes most of it.
"""

import io
import json
import shutil
import sys
import wave
from pathlib import Path

import pytest
from cyclopts import App

from cli.main import app, run
from cli.options import check_options, option_names
from tests.docs.blocks import DOCS, PAGES, ROOT, own_commands, shell_lines
from tts2face.models.palette import Palette, load_palette, write_palette
from tts2face.session import Session
from tts2face.storage.files import SHIPPED_FOLDER

README, CLI_PAGE = ROOT / "README.md", DOCS / "cli.md"
SMALL = ["--size", "64x64", "--fps", "5"]
PERSON, WINDOW, LONG = "needs video of a person", "opens a window", "takes over a minute"
NOT_EXECUTED = {  # beginning of a command line: why it is parsed only
    '"Hello." --view': WINDOW,
    '"Hello." --talker me.talker --face self': PERSON,
    "mimic take.mp4": PERSON,
    "mimic --camera": WINDOW,
    "corpus setup": "uses the network",
    "corpus build": PERSON,
    "corpus face": PERSON,
    "corpus gestures": PERSON,
    "corpus audio-maps": PERSON,
    "corpus evaluate": PERSON,
    "report gestures": LONG,
}
LISTS = {"voices", "languages", "faces", "identities", "styles", "talkers", "phones", "completion", "corpus", "report"}
EXECUTED_PAGES = (README, CLI_PAGE)


def not_executed(line: str) -> str | None:
    """Why a command line is not executed."""
    command = line.partition("tts2face ")[2]
    return next((reason for start, reason in NOT_EXECUTED.items() if command.startswith(start)), None)


OWN_LINES = [(page.name, line) for page in PAGES for line in shell_lines(page) if own_commands(line)]
EXECUTED = [line for page in EXECUTED_PAGES for line in shell_lines(page) if own_commands(line) and not not_executed(line)]


def commands_of(command: App, path: tuple[str, ...] = ()) -> dict[tuple[str, ...], App]:
    """Every command that does something, by the words that call it."""
    found = {path: command} if command.default_command is not None else {}
    for name in command:
        if not name.startswith("-"):
            found |= commands_of(command[name], (*path, name))
    return found


@pytest.fixture(scope="module")
def inputs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The files that the examples read: made by the project itself, small, with the names of the examples."""
    folder = tmp_path_factory.mktemp("inputs")
    (folder / "chapter.txt").write_text("Chapter one. It was late.", encoding="utf-8")
    (folder / "speech.txt").write_text("Hello there.", encoding="utf-8")
    (folder / "words.txt").write_text("gif  JH IH1 F\n", encoding="utf-8")
    (folder / "timeline.json").write_text('{"style": "delighted", "nods": [{"time": 0.2}]}', encoding="utf-8")
    session = Session()
    sound = session.clip("Hello there.").speech.waveform
    with wave.open(str(folder / "speech.wav"), "wb") as file:
        file.setparams((1, 2, sound.rate, 0, "NONE", ""))
        file.writeframes((sound.samples * 32767).astype("<i2").tobytes())
    shutil.copy(SHIPPED_FOLDER / "grid_s1.talker", folder / "me.talker")
    shutil.copy(SHIPPED_FOLDER / "head.face", folder / "me.face")
    starter = load_palette("starter")
    styles = {"mine" if name == "grid_s1" else name: style for name, style in starter.styles.items()}
    write_palette(folder / "mine.palette", Palette(starter.neutral, starter.regions, styles, {}))
    shapes = [shape for shape in session.mesh.shape_names[:52]]
    rows = ["Timecode,BlendshapeCount," + ",".join(shape[0].upper() + shape[1:] for shape in shapes)]
    rows += [f"00:00:{i // 60:02d}:{i % 60:02d}.000,61," + ",".join(["0.1"] * len(shapes)) for i in range(90)]
    (folder / "take.csv").write_text("\n".join(rows), encoding="utf-8")
    return folder


@pytest.fixture
def here(inputs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for path in inputs.iterdir():
        (tmp_path / path.name).symlink_to(path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(("page", "line"), OWN_LINES, ids=lambda text: text[:60])
def test_every_command_line_is_understood(page: str, line: str) -> None:
    for words in own_commands(line):
        if {"--help", "--version"} & set(words):
            continue
        check_options(app, words)
        app.parse_args(words, exit_on_error=False, print_error=False)


@pytest.mark.parametrize("line", EXECUTED, ids=lambda line: line.split("#")[0].strip())
def test_command_lines_of_readme_and_cli_page_work(
    line: str, here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    if line.startswith("echo"):
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(b"Good morning.\n")))
    (words,) = own_commands(line)
    is_clip = words[0] not in LISTS and not words[0].startswith(("--help", "--version"))
    if is_clip:
        words = [*words[: _end_of_options(words)], *_small(words), *words[_end_of_options(words) :]]
    if words[:2] == ["report", "similarity"]:
        words += ["--halves", "2"]
    assert run(words) == 0, capsys.readouterr().err
    for flag in ("--out", "--explain"):
        if flag in words:
            assert (here / words[words.index(flag) + 1]).exists()
    if not is_clip and "--out" not in words:
        printed = capsys.readouterr().out
        assert printed
        if "--json" in words:
            assert json.loads(printed)


def _end_of_options(words: list[str]) -> int:
    return words.index("--") if "--" in words else len(words)


def _small(words: list[str]) -> list[str]:
    """Options for a small clip that the line does not set itself."""
    given = zip(SMALL[::2], SMALL[1::2], strict=True)
    return [word for name, value in given if name not in words for word in (name, value)]


def test_every_command_stands_on_the_cli_page() -> None:
    shown = [tuple(words) for line in shell_lines(CLI_PAGE) for words in own_commands(line)]
    missing = [path for path in commands_of(app) if path and not any(words[: len(path)] == path for words in shown)]
    assert not missing


def test_options_named_in_the_documentation_exist() -> None:
    known = {name for command in commands_of(app).values() for name in option_names(command)}
    known |= {"--help", "--version", "--", "--strict", "--noise"}
    words = {word.split("=")[0] for _, line in OWN_LINES for own in own_commands(line) for word in own}
    assert {word for word in words if word.startswith("--") and word != "--five"} <= known


def test_reasons_name_command_lines_that_exist() -> None:
    lines = [line.partition("tts2face ")[2] for page in EXECUTED_PAGES for line in shell_lines(page)]
    assert not [start for start in NOT_EXECUTED if not any(line.startswith(start) for line in lines)]


def test_readme_holds_the_two_promised_commands() -> None:
    lines = shell_lines(README)
    text = "We were away a year ago, but Bob may move five big maps."
    assert f'pip install . && tts2face "{text}" --out clip.mp4' in lines
    assert "pip install '.[test]' && pytest" in lines
