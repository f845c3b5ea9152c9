"""The examples of docs/http.md, against a running service."""

import shutil
from pathlib import Path

import httpx
import pytest
from PIL import Image

import tts2face
from tests.docs.blocks import DOCS, code_blocks
from tests.running import RunningService
from tts2face.storage.shipped import find_file

EXAMPLES = code_blocks(DOCS / "http.md", "python")


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the files that the examples read."""
    monkeypatch.chdir(tmp_path)
    tts2face.export(tts2face.Session().clip("We were away a year ago."), tmp_path / "speech.wav")
    Image.new("RGB", (64, 64), (20, 40, 60)).save(tmp_path / "wall.png")
    (tmp_path / "talk.srt").write_text("1\n00:00:00,500 --> 00:00:02,000\nANN: Hello.\n")
    shutil.copy(find_file("ada", "face"), tmp_path / "anna.face")
    (tmp_path / "names.txt").write_text("Siobhan  SH IH0 V AO1 N\n")
    (tmp_path / "anna.txt").write_text("We may.")
    tts2face.Session().write("We may.", tmp_path / "anna.mp4", size="64x64")
    return tmp_path


def test_the_examples_run(service: RunningService, here: Path) -> None:
    assert len(EXAMPLES) >= 7
    namespace: dict[str, object] = {}
    for example in EXAMPLES:
        assert "http://localhost:8880" in example
        exec(compile(example.replace("http://localhost:8880", service.url), "docs/http.md", "exec"), namespace)
    assert (here / "clip.mp4").stat().st_size > 5_000
    assert (here / "hello.mp4").stat().st_size > 100_000
    assert (here / "hello.mp3").stat().st_size > 2_000
    curves, queued = namespace["curves"], namespace["queued"]
    assert isinstance(curves, httpx.Response)
    assert isinstance(queued, httpx.Response)
    assert (curves.status_code, queued.status_code) == (200, 202), (curves.text[:500], queued.text)
