"""The tutorial of docs/plugins.md is installed as it stands, and used by every door."""

import json
import re
import wave
from collections.abc import Mapping
from pathlib import Path

import httpx
import numpy as np
import pytest

from tests.docs.blocks import DOCS
from tests.docs.programs import install, run
from tests.running import serve_process

PAGE = DOCS / "plugins.md"
FILE = re.compile(r"^\*\*([\w.]+\.\w+)\*\*.*?^```\w+\n(.*?)^```$", re.MULTILINE | re.DOTALL)
BROKEN = "[tts2face.voices]\nbroken = absent_module:VOICE\nheart = tutorial_voice:QUIET\n"
TOOL = """
from tts2face.processes.program import ProcessLimits
from tts2face.processes.parent import Child
from tts2face.processes.program import Program

child = Child(Program("loudest", ProcessLimits(memory_bytes=2 << 30, cpu_s=60, file_bytes=1 << 20, n_files=64)))
try:
    print(child.call("loudest", {"path": "hello.wav"}).content["loudest"])
finally:
    child.close()
"""


@pytest.fixture(scope="module")
def environment(tmp_path_factory: pytest.TempPathFactory) -> Mapping[str, str]:
    """Variables with which Python finds the installed tutorial, and a plugin that cannot be loaded."""
    source, target = tmp_path_factory.mktemp("tutorial"), tmp_path_factory.mktemp("installed")
    files = FILE.findall(PAGE.read_text(encoding="utf-8"))
    assert [name for name, _ in files] == [
        "pyproject.toml", "tutorial_voice.py", "tutorial_export.py", "tutorial_tool.py"
    ]  # fmt: skip
    for name, content in files:
        (source / name).write_text(content, encoding="utf-8")
    variables = install(source, target)
    about = target / "broken-1.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: broken\nVersion: 1\n")
    (about / "entry_points.txt").write_text(BROKEN)
    return variables


def loudest(path: Path) -> float:
    with wave.open(str(path)) as file:
        return float(np.abs(np.frombuffer(file.readframes(file.getnframes()), np.int16) / 32768).max())


def test_command_line_and_python_use_the_plugins(environment: Mapping[str, str], tmp_path: Path) -> None:
    voices = json.loads(run("tts2face voices --json", tmp_path, environment=environment).stdout)
    listed = {one["name"]: one for one in voices}
    assert listed["quiet"]["summary"] == "espeak-ng at a quarter of its level"
    assert (listed["broken"]["is_installed"], "absent_module" in listed["broken"]["summary"]) == (False, True)
    assert listed["heart"]["engine"] == "hibari"  # what is shipped wins
    formats = json.loads(run("tts2face formats --json", tmp_path, environment=environment).stdout)
    assert formats[-1]["name"] == "opening"
    words = 'tts2face "Hello there." --plain-delivery --face head'
    exports = ("--out", "hello.wav", "--export", "hello.opening.txt", "--export", "opening:other.dat")
    spoken = run(words, tmp_path, "--voice", "quiet", *exports, environment=environment)
    assert spoken.returncode == 0, spoken.stderr
    lines = (tmp_path / "hello.opening.txt").read_text().splitlines()
    assert len(lines) > 20
    assert 0.0 < max(map(float, lines)) <= 1.0
    assert (tmp_path / "other.dat").read_text().splitlines() == lines
    found = run("python -c", tmp_path, TOOL, environment=environment)
    assert float(found.stdout) == pytest.approx(loudest(tmp_path / "hello.wav"), abs=1e-4), found.stderr
    refused = run(words, tmp_path, "--voice", "broken", "--out", "no.wav", environment=environment)
    assert refused.returncode != 0
    assert "the voice broken of the package broken cannot be loaded (ModuleNotFoundError" in refused.stderr


def test_the_service_uses_the_plugins(environment: Mapping[str, str]) -> None:
    with serve_process(environment=environment) as running, httpx.Client(base_url=running.url, timeout=300.0) as client:
        assert "quiet" in [one["id"] for one in client.get("/v1/voices").json()["voices"]]
        body = {"text": "Hello there.", "voice": "quiet", "format": "opening", "face": "head"}
        answer = client.post("/v1/clips", json=body)
        assert answer.status_code == 200, answer.text
        assert len(answer.text.splitlines()) > 20
        refused = client.post("/v1/clips", json=body | {"voice": "broken"})
        assert (refused.status_code, "there is no voice 'broken'" in refused.text) == (400, True)
