"""Every command line of README and cli.md is executed, but those in `tests.docs.blocks.NOT_EXECUTED`."""

import functools
import importlib.util
import io
import json
import shutil
import sys
import wave
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

from cli.main import run
from corpus_tools.studies.gestures import moods
from tests.docs.blocks import (
    EXECUTED_PAGES,
    own_commands,
    reason_not_executed,
    shell_lines,
)
from tests.interchange.characters.made import write_character_file, write_landmarks
from tests.interchange.transcripts.grids import textgrid
from tests.photo.pictures import SMILE, still
from tts2face import Picture, Project, Request, export, import_face, save_face, save_project, write_clip
from tts2face.models.palette import Palette
from tts2face.models.palette_file import load_palette, write_palette
from tts2face.photo import face_from_photo
from tts2face.serving.work.database import prepare_database
from tts2face.session import session
from tts2face.storage.shipped import SHIPPED_FOLDER

SMALL = {"--size": "64x64", "--fps": "5"}


LISTS = {
    "haircuts",
    "hair-colors",
    "voices",
    "languages",
    "faces",
    "identities",
    "styles",
    "talkers",
    "formats",
    "phones",
    "completion",
    "jobs",
    "serve",
    "keys",
}


TOOLS = {"corpus", "report", "convert", "render", "face", "inspect"}

MODULES = {  # parts of command lines, and the modules of extras without which these end in an error
    "report similarity": ("matplotlib", "sklearn"),
    "report gestures": ("matplotlib",),
    "report moods": ("matplotlib", "ai_edge_litert"),
    "face picture": ("ai_edge_litert",),
    "face photo": ("ai_edge_litert",),
    "face calibrate": ("ai_edge_litert",),
    " --photo ": ("ai_edge_litert",),
    ".usda": ("pxr",),
}


EXECUTED = [
    line
    for page in EXECUTED_PAGES
    for line in shell_lines(page)
    if own_commands(line) and not reason_not_executed(line)
]


def line_parameter(line: str) -> Any:
    """A line whose test is skipped where a package of an extra is missing."""
    modules = [name for part, needed in MODULES.items() if part in line for name in needed]
    return pytest.param(line, id=line.split("#", maxsplit=1)[0].strip(), marks=pytest.mark.needs(*modules))


@pytest.fixture(scope="module", autouse=True)
def kept_sessions() -> Iterator[None]:
    """Sessions with the same models are one: loading a voice and lighting a face take longer than a small clip."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(session, "Session", functools.cache(session.Session))
        yield


@pytest.fixture(scope="module")
def inputs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The files that the examples read: made by the project itself, small, with the names of the examples."""
    folder = tmp_path_factory.mktemp("inputs")
    (folder / "chapter.txt").write_text("Chapter one. It was late.", encoding="utf-8")
    (folder / "speech.txt").write_text("Hello there.", encoding="utf-8")
    (folder / "speech.TextGrid").write_text(textgrid(words=[(0, 0.3, "Hello"), (0.3, 0.6, "there")]))
    (folder / "words.txt").write_text("gif  JH IH1 F\n", encoding="utf-8")
    save_project(
        Project(request=Request(text="Hello.", voice="espeak", fps=5), picture=Picture(size="64x64")),
        folder / "scene.json",
    )
    (folder / "timeline.json").write_text('{"style": "delighted", "nods": [{"time": 0.2}]}', encoding="utf-8")
    (folder / "one.srt").write_text("1\n00:00:00,000 --> 00:00:01,000\nANN: Hello.\n", encoding="utf-8")
    (folder / "cast.toml").write_text('[[role]]\nspeaker = "ANN"\nvoice = "espeak"\n', encoding="utf-8")
    spoken = session.Session("grid_s1", "ada", identity=None, palette="starter")
    clip = spoken.clip("Hello there.", fps=5)
    export(clip, folder / "hello.track.json")
    write_clip(clip, spoken.face, folder / "hello.mp4", picture=Picture(size="64x64"))
    sound = clip.speech.waveform
    with wave.open(str(folder / "speech.wav"), "wb") as file:
        file.setparams((1, 2, sound.rate, 0, "NONE", ""))
        file.writeframes((sound.samples * 32767).astype("<i2").tobytes())
    shutil.copy(SHIPPED_FOLDER / "grid_s1.talker", folder / "me.talker")
    shutil.copy(SHIPPED_FOLDER / "head.face", folder / "me.face")
    Image.fromarray(still("tomas", 320)).save(folder / "me.jpg")
    Image.fromarray(still("tomas", 320, **SMILE)).save(folder / "me2.jpg")
    (folder / "fit.json").write_text('{"pivot": [160, 200]}', encoding="utf-8")
    starter = load_palette("starter")
    styles = {"mine" if name == "grid_s1" else name: style for name, style in starter.styles.items()}
    write_palette(folder / "mine.palette", Palette(starter.neutral, starter.regions, styles, {}))
    shapes = spoken.mesh.shape_names[:52]
    rows = ["Timecode,BlendshapeCount," + ",".join(shape[0].upper() + shape[1:] for shape in shapes)]
    rows += [f"00:00:00:{i:02d}.000,61," + ",".join(["0.1"] * len(shapes)) for i in range(20)]
    (folder / "take.csv").write_text("\n".join(rows), encoding="utf-8")
    character = write_character_file(folder / "character.glb")
    landmarks = write_landmarks(folder / "landmarks.tsv")
    save_face(folder / "mine.face", import_face(character, landmarks=landmarks).face)
    return folder


@pytest.fixture
def here(inputs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for path in inputs.iterdir():
        (tmp_path / path.name).symlink_to(path)
    if importlib.util.find_spec("dbos"):
        prepare_database(f"sqlite:///{tmp_path / 'jobs.sqlite'}")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(face_from_photo, "user_cache", lambda: tmp_path / "cache")
    return tmp_path


@pytest.mark.parametrize("line", [line_parameter(line) for line in EXECUTED])
def test_command_lines_of_readme_and_cli_page_work(
    line: str, here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    if line.startswith("echo"):
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(b"Good morning.\n")))
    (words,) = own_commands(line)
    is_clip = words[0] not in LISTS | TOOLS and not words[0].startswith(("--help", "--version"))
    if is_clip:
        words = _small(words)
    if words[:2] == ["report", "similarity"]:
        words += ["--halves", "2"]
    if words[:2] == ["report", "moods"]:
        words += ["--size", "160"]
        few = functools.partial(moods.MoodOptions, frames=2, sentences=("Bob may.",))
        monkeypatch.setattr(moods, "MoodOptions", few)
    if words[:2] == ["face", "calibrate"]:  # takes minutes with the poses that a face needs
        monkeypatch.setattr("corpus_tools.training.calibrate_face.N_POSES", 40)
        monkeypatch.setattr("corpus_tools.training.calibrate_face.N_DRAWN", ((2, 2),))
    assert run(words) == 0, capsys.readouterr().err
    named = [after for word, after in pairwise(words) if word in {"--out", "--explain", "--export"}]
    named += [word for word in words[2:] if "." in word] if words[0] == "convert" else []
    assert "--dry-run" in words or all((here / name).exists() for name in named)
    if not is_clip and not named:
        printed = capsys.readouterr().out
        assert printed
        if "--json" in words:
            assert json.loads(printed)


def _small(words: list[str]) -> list[str]:
    """The same command for a small clip of few frames."""
    kept = [word for before, word in zip(["", *words], words, strict=False) if not {before, word} & set(SMALL)]
    end = kept.index("--") if "--" in kept else len(kept)
    return [*kept[:end], *(word for option in SMALL.items() for word in option), *kept[end:]]
