"""Every command line of the documentation that needs video of a person, on rendered takes."""

import contextlib
import functools
import shlex
import wave
from collections.abc import Callable
from pathlib import Path

import pytest

from cli.main import run
from lexicon import errors
from tests.docs.blocks import lines_that_need_a_person
from tests.packages import needs
from tts2face.video.media import read_sound
from tts2face.video.networks import find_bundle

SMALL = ["--size", "64x64", "--fps", "5"]
FOLDERS = {"recordings": 6, "few": 2}  # numbers of recordings
WITH_FEW = ("corpus face", "report retarget")  # commands that look at every frame
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
    for name, number in FOLDERS.items():
        (folder / name / "clips").mkdir(parents=True)
        (folder / name / "align").mkdir()
        rows = (rendered_takes / "manifest.csv").read_text(encoding="utf-8").splitlines()[: 1 + number]
        (folder / name / "manifest.csv").write_text("\n".join(rows), encoding="utf-8")
        for row in rows[1:]:
            for part in (f"clips/{row.split(',')[0]}.mkv", f"align/{row.split(',')[0]}.align"):
                (folder / name / part).symlink_to(rendered_takes / part)
    return folder


@pytest.fixture(scope="module")
def built(materials: Path) -> Callable[[str], None]:
    """Runs a command of the README in the folder of the materials, once: what it makes, other commands read."""

    @functools.cache
    def make(line: str) -> None:
        run_line(line, materials)

    return make


def with_little(line: str) -> str:
    """The same command on less material."""
    folder = "few/" if any(command in line for command in WITH_FEW) else "recordings/"
    return line.replace("--hold-out 100", "--hold-out 2").replace("recordings/", folder)


def run_line(line: str, folder: Path) -> None:
    """Run a command of the README in a folder, at a small size."""
    words = shlex.split(line)[1:]
    if words[0] not in {"phones", "corpus", "report", "voices", "identities", "styles"}:
        words += SMALL
    with contextlib.chdir(folder):
        assert run(words) == 0, words


@pytest.mark.parametrize("line", readme_commands())
def test_every_command_of_the_readme_works(
    line: str, here: Path, materials: Path, built: Callable[[str], None]
) -> None:
    sources = {name: sign for name, sign in BUILT_BY.items() if name in line and sign not in line}
    if sources or any(word in line for word in ("corpus", "mimic", "report")):
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
        run_line(with_little(line), here)
    words = shlex.split(line)
    for flag in ("--out", "--explain", "--report"):
        if flag in words:
            assert (folder / words[words.index(flag) + 1]).exists()


def require_landmark_model() -> None:
    needs("ai_edge_litert")
    try:
        find_bundle()
    except errors.BackendError as missing:
        pytest.skip(str(missing))
